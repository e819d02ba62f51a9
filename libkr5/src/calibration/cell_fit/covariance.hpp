// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

/// @file
/// Private: the covariance that belongs to an information matrix.

namespace kr5::calibration::cell_fit {

/// Inverse of a symmetric positive semidefinite matrix, each coordinate scaled by its own information. Combinations of
/// coordinates that keep less than rank_tolerance of their sensitivity, and coordinates of which nothing is known, get
/// none: what the pseudo-inverse gives.
Eigen::MatrixXd covariance_of(const Eigen::MatrixXd& information, double rank_tolerance);

}  // namespace kr5::calibration::cell_fit
