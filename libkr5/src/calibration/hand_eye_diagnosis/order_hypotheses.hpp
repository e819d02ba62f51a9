// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "calibration/hand_eye_diagnosis/hypotheses.hpp"

namespace kr5::calibration::evidence {

/// Readings in which poses and images are paired in another order.
std::vector<SetupHypothesis> reordered_readings(const Case& c, int seed);

/// For each row the column that minimises the sum of a square cost matrix (Jonker and Volgenant 1987).
std::vector<int> best_assignment(const Eigen::MatrixXd& cost);

}  // namespace kr5::calibration::evidence
