// SPDX-License-Identifier: BSD-3-Clause
#include "identification/log/residual_correlation.hpp"

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

VectorXd autocovariances(const VectorXd& series, const std::vector<RowRange>& runs) {
  constexpr Index max_order = 30, samples_of_order = 20;
  VectorXd out = VectorXd::Zero(std::min(max_order, series.size() / samples_of_order) + 1);
  for (const RowRange& run : runs)
    for (Index lag = 0; lag < std::min(out.size(), run.size()); ++lag)
      out[lag] += series.segment(run.first, run.size() - lag).dot(series.segment(run.first + lag, run.size() - lag));
  return out / static_cast<double>(std::max<Index>(1, series.size()));
}

Autoregression autoregression_of(const VectorXd& covariance, Index rows) {
  constexpr double exact = 1e-14;  // part of the variance that is rounding
  Autoregression out{{}, std::sqrt(covariance[0]), covariance[0], {}};
  if (!(covariance[0] > std::numeric_limits<double>::min())) return out;
  const auto count = static_cast<double>(rows);
  double least = count * std::log(covariance[0]), error = covariance[0];
  VectorXd a = VectorXd::Zero(covariance.size() - 1);
  for (Index order = 1; order < covariance.size(); ++order) {  // Levinson's recursion
    const VectorXd before = a.head(order - 1);
    const double reflection = -(covariance[order] + before.dot(covariance.segment(1, order - 1).reverse())) / error;
    a.head(order - 1) += reflection * before.reverse();
    a[order - 1] = reflection;
    error *= 1.0 - reflection * reflection;
    if (!(error > exact * covariance[0])) break;
    const double bic = count * std::log(error) + static_cast<double>(order) * std::log(count);
    if (bic >= least) continue;
    least = bic;
    out.a = a.head(order);
    out.sigma = std::sqrt(error);
  }
  out.correlations = covariance.segment(1, out.a.size()) / covariance[0];
  return out;
}

Autoregression fit_autoregression(const VectorXd& series, const std::vector<RowRange>& runs) {
  return autoregression_of(autocovariances(series, runs), series.size());
}

Autoregression fit_autoregression(const VectorXd& series) { return fit_autoregression(series, {{0, series.size()}}); }

std::vector<double> Autoregression::autocorrelations(Index longest) const {
  constexpr double negligible = 1e-3;
  std::vector<double> out;
  Index small = 0;
  while (a.size() > 0 && small <= a.size() && static_cast<Index>(out.size()) < longest) {
    const auto lag = static_cast<Index>(out.size()) + 1;
    double value = lag <= correlations.size() ? correlations[lag - 1] : 0.0;
    for (Index k = 1; lag > correlations.size() && k <= a.size(); ++k)
      value -= a[k - 1] * out[static_cast<std::size_t>(lag - 1 - k)];
    out.push_back(value);
    small = std::abs(value) < negligible ? small + 1 : 0;
  }
  return out;
}

double Autoregression::long_run_variance() const {
  const double gain = 1.0 + a.sum();
  return sigma * sigma / (gain * gain);
}

double Autoregression::variance_inflation() const { return variance > 0 ? long_run_variance() / variance : 1.0; }

double Autoregression::samples_per_independent() const { return std::max(1.0, variance_inflation()); }

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
  for (const RowRange& run : runs) longest = std::max(longest, run.size());
  const Autoregression model = fit_autoregression(residuals, runs);
  const std::vector<double> correlations = model.autocorrelations(longest - 1);
  out.inflation = model.variance_inflation();

  MatrixXd middle = unit.transpose() * unit;
  const MatrixXd inverse = middle.ldlt().solve(MatrixXd::Identity(n, n));
  for (std::size_t k = 0; k < correlations.size(); ++k) {
    const auto lag = static_cast<Index>(k) + 1;
    MatrixXd lagged = MatrixXd::Zero(n, n);
    for (const RowRange& run : runs) {
      const Index pairs = run.size() - lag;
      if (pairs > 0)
        lagged.noalias() += unit.middleRows(run.first, pairs).transpose() * unit.middleRows(run.first + lag, pairs);
    }
    middle += correlations[k] * (lagged + lagged.transpose());
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
