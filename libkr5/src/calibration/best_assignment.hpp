// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

/// @file
/// Private: which of one list belongs to which of another.

namespace kr5::calibration {

/// For each row the column that minimises the sum of a square cost matrix (Jonker and Volgenant 1987).
std::vector<int> best_assignment(const Eigen::MatrixXd& cost);

}  // namespace kr5::calibration
