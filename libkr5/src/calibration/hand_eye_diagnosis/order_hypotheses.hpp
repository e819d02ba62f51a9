// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "calibration/hand_eye_diagnosis/hypotheses.hpp"

namespace kr5::calibration::evidence {

/// Readings in which poses and images are paired in another order.
std::vector<SetupHypothesis> reordered_readings(const Case& c, int seed);

}  // namespace kr5::calibration::evidence
