// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/physics/row_range.hpp>

/// @file
/// Correlation of residuals from sample to sample, by an autoregressive model, and the covariance of a least-squares
/// estimate from such residuals.

namespace kr5::identification {

/// Autoregressive model of a stationary series: e_t + a_1 e_(t-1) + ... = noise of standard deviation `sigma`.
struct Autoregression {
  Eigen::VectorXd a;
  double sigma = 0.0;
  double variance = 0.0;         ///< Of the series itself.
  Eigen::VectorXd correlations;  ///< Autocorrelations of the series at lags 1 to the order.

  /// Autocorrelations at lags 1, 2, ... as far as they matter, `longest` at most.
  std::vector<double> autocorrelations(Eigen::Index longest) const;
  /// Variance of a mean of many values, times their number.
  double long_run_variance() const;
  /// The same over the variance of a value [-].
  double variance_inflation() const;
  /// The same, 1 at least [-].
  double samples_per_independent() const;
};

/// Autocovariances of a series at lags 0 to the greatest order of a model that is fitted to so many rows. Rows are
/// evenly spaced within each run; pairs of different runs do not count. Sums are divided by all rows, also where a lag
/// has fewer pairs, so that they are those of a stationary series.
Eigen::VectorXd autocovariances(const Eigen::VectorXd& series, const std::vector<physics::RowRange>& runs);
/// The model of these autocovariances of so many rows, by Yule and Walker's equations, of the order with the least BIC.
Autoregression autoregression_of(const Eigen::VectorXd& autocovariances, Eigen::Index rows);
/// Both.
Autoregression fit_autoregression(const Eigen::VectorXd& series, const std::vector<physics::RowRange>& runs);
/// Of a series without interruption.
Autoregression fit_autoregression(const Eigen::VectorXd& series);

struct CorrelatedCovariance {
  Eigen::MatrixXd covariance;  ///< Empty when the residuals do not determine every parameter.
  double variance = 0.0;       ///< Of a residual.
  double inflation = 1.0;      ///< Variance of the mean of many residuals over that without correlation [-].
};

/// A^-1 (J' R J) A^-1 with A = J' J, where R follows from the autoregressive model of the residuals; for residuals
/// without correlation the usual covariance. It is widened for the degrees of freedom that correlated residuals leave.
/// Rows are evenly spaced within each run.
/// @param jacobian Derivatives of the residuals, rows x parameters.
CorrelatedCovariance correlated_covariance(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residuals,
                                           const std::vector<physics::RowRange>& runs);

}  // namespace kr5::identification
