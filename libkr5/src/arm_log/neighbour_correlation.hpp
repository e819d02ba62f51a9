// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

namespace kr5::arm_log {

/// Correlation of neighbours of a series about zero, by which fewer samples count: 0 to 0.999.
double neighbour_correlation(const Eigen::Ref<const Eigen::VectorXd>& x);

/// Rows of matrices of equal width, one after the other.
Eigen::MatrixXd stacked_rows(const std::vector<Eigen::MatrixXd>& parts);

}  // namespace kr5::arm_log
