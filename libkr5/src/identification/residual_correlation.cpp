// SPDX-License-Identifier: BSD-3-Clause
#include "residual_correlation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/QR>

#include <kr5/uncertainty/confidence.hpp>

namespace kr5::identification {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using physics::RowRange;

namespace {

/// Sum over the runs of r_i r_(i + lag).
double lagged_sum(const VectorXd& r, const std::vector<RowRange>& runs, Index lag) {
  double sum = 0.0;
  for (const RowRange& run : runs) {
    const Index pairs = run.last - run.first - lag;
    if (pairs > 0) sum += r.segment(run.first, pairs).dot(r.segment(run.first + lag, pairs));
  }
  return sum;
}

/// Coefficients of the autoregressive model that BIC prefers, by Levinson's recursion.
std::vector<double> autoregression(const std::vector<double>& autocovariance, double samples) {
  std::vector<double> now, best;
  double error = autocovariance[0], lowest = samples * std::log(error);
  for (std::size_t order = 1; order < autocovariance.size(); ++order) {
    double reflection = autocovariance[order];
    for (std::size_t k = 0; k < now.size(); ++k) reflection -= now[k] * autocovariance[order - 1 - k];
    reflection /= error;
    std::vector<double> next = now;
    for (std::size_t k = 0; k < now.size(); ++k) next[k] -= reflection * now[now.size() - 1 - k];
    next.push_back(reflection);
    now = std::move(next);
    error *= 1 - reflection * reflection;
    if (!(error > 0)) break;
    const double criterion = samples * std::log(error) + static_cast<double>(order) * std::log(samples);
    if (criterion < lowest) lowest = criterion, best = now;
  }
  return best;
}

/// Autocorrelations of such a model at lags 1, 2, … as far as they matter; those up to its order are the measured ones.
std::vector<double> autocorrelations(const std::vector<double>& model, const std::vector<double>& autocovariance,
                                     Index longest) {
  constexpr double negligible = 1e-3;
  std::vector<double> out;
  std::size_t small = 0;
  while (!model.empty() && small <= model.size() && static_cast<Index>(out.size()) < longest) {
    const std::size_t lag = out.size() + 1;
    double value = 0.0;
    if (lag <= model.size()) {
      value = autocovariance[lag] / autocovariance[0];
    } else {
      for (std::size_t k = 0; k < model.size(); ++k) value += model[k] * out[lag - 2 - k];
    }
    out.push_back(value);
    small = std::abs(value) < negligible ? small + 1 : 0;
  }
  return out;
}

}  // namespace

CorrelatedCovariance correlated_covariance(const MatrixXd& jacobian, const VectorXd& residuals,
                                           const std::vector<RowRange>& runs) {
  CorrelatedCovariance out;
  const Index rows = jacobian.rows(), n = jacobian.cols();
  const auto freedom = static_cast<double>(std::max<Index>(rows - n, 1));
  out.variance = residuals.squaredNorm() / freedom;
  const VectorXd scale = jacobian.colwise().norm().transpose();
  if (rows < n || !(scale.minCoeff() > 0) || !scale.allFinite()) return out;
  const MatrixXd unit = jacobian * scale.cwiseInverse().asDiagonal();
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(unit);
  if (!(std::abs(qr.matrixR()(n - 1, n - 1)) > 1e-7)) return out;  // the first one is 1

  Index longest = 0;
  for (const RowRange& run : runs) longest = std::max(longest, run.last - run.first);
  constexpr Index greatest_order = 20, samples_of_order = 50;
  std::vector<double> autocovariance;
  for (Index lag = 0; lag <= std::min(greatest_order, rows / samples_of_order); ++lag)
    autocovariance.push_back(lagged_sum(residuals, runs, lag) / freedom);
  std::vector<double> correlations;
  if (out.variance > std::numeric_limits<double>::min())
    correlations = autocorrelations(autoregression(autocovariance, freedom), autocovariance, longest - 1);

  MatrixXd middle = unit.transpose() * unit;
  const MatrixXd inverse = middle.ldlt().solve(MatrixXd::Identity(n, n));
  for (std::size_t k = 0; k < correlations.size(); ++k) {
    const auto lag = static_cast<Index>(k) + 1;
    MatrixXd lagged = MatrixXd::Zero(n, n);
    for (const RowRange& run : runs) {
      const Index pairs = run.last - run.first - lag;
      if (pairs > 0)
        lagged.noalias() += unit.middleRows(run.first, pairs).transpose() * unit.middleRows(run.first + lag, pairs);
    }
    middle += correlations[k] * (lagged + lagged.transpose());
    out.inflation += 2 * correlations[k];
  }
  // What the estimate takes out of correlated residuals: E[r' r] = variance (rows - tr(A^-1 J' R J)).
  const double left = static_cast<double>(rows) - (inverse * middle).trace();
  out.variance = residuals.squaredNorm() / std::max(left, 1.0);
  const VectorXd back = scale.cwiseInverse();
  const double freedoms = std::max(left / std::max(out.inflation, 1.0), 1.0);
  const double widened = out.variance * uncertainty::covariance_inflation(static_cast<double>(n), freedoms);
  out.covariance = widened * back.asDiagonal() * inverse * middle * inverse * back.asDiagonal();
  return out;
}

}  // namespace kr5::identification
