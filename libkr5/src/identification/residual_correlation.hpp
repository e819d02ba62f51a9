// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/physics/row_range.hpp>

/// @file
/// Covariance of a least-squares estimate whose residuals are correlated from sample to sample.

namespace kr5::identification {

struct CorrelatedCovariance {
  Eigen::MatrixXd covariance;  ///< Empty when the residuals do not determine every parameter.
  double variance = 0.0;       ///< Of a residual.
  double inflation = 1.0;      ///< Variance of the mean of many residuals over that without correlation [-].
};

/// A^-1 (J' R J) A^-1 with A = J' J, where R follows from an autoregressive model of the residuals (Yule-Walker, order
/// by BIC); for residuals without correlation the usual covariance. It is widened for the degrees of freedom that
/// correlated residuals leave. Rows are evenly spaced within each run.
/// @param jacobian Derivatives of the residuals, rows x parameters.
CorrelatedCovariance correlated_covariance(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                                           const std::vector<physics::RowRange>& runs);

}  // namespace kr5::identification
