// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

/// @file
/// Private: residuals that err together, made independent.

namespace kr5::fit {

/// Lower triangular W with W' W = C^-1, for 3, 6 or any number of residuals.
template <int Size>
Eigen::Matrix<double, Size, Size> whitening_of(const Eigen::MatrixXd& covariance, Eigen::Index size = Size);

}  // namespace kr5::fit
