// SPDX-License-Identifier: BSD-3-Clause
#include "identification/log/torque_checks.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <Eigen/Cholesky>

#include <kr5/core/statistics.hpp>

#include "identification/log/residual_correlation.hpp"
#include "identification/short_number.hpp"

namespace kr5::identification {

namespace {

constexpr Index most_regression_rows = 1500;
constexpr double max_torque_delay = 0.2;  // that is searched [s]
constexpr double clear_gain = 0.65;       // of the residual sum of squares, which a delay must undercut
constexpr double explained = 0.7;         // of the variance of a torque, below which its clock is not judged
constexpr double sure_sigmas = 5.0;
constexpr double shortest_rest = 0.3;  // [s]
constexpr double resting = 3e-4;       // motion of any joint at rest [rad or m]

/// Rows in motion, evenly thinned, with room for the lags.
std::vector<Index> moving_rows(const SmoothedLog& smooth, Index margin) {
  const VectorXd fastest = smooth.qd.cwiseAbs().colwise().maxCoeff().transpose();
  std::vector<Index> moving;
  for (Index i = margin; i < smooth.q.rows() - margin; ++i)
    if (smooth.inside(i, margin) && (smooth.qd.row(i).transpose().cwiseAbs().array() > 0.02 * fastest.array()).any() &&
        fastest.maxCoeff() > 0)
      moving.push_back(i);
  std::vector<Index> out;
  const std::size_t every = std::max<std::size_t>(1, moving.size() / most_regression_rows);
  for (std::size_t k = 0; k < moving.size(); k += every) out.push_back(moving[k]);
  return out;
}

// Clocks

struct LagEstimate {
  double lag = 0.0;
  double gain = 1.0;  ///< Cost there over the cost without a lag.
  double explained = 0.0;
};

LagEstimate best_lag(const MatrixXd& costs, const std::vector<Index>& lags, Index zero, Index joint, double total) {
  Index at = 0;
  costs.col(joint).minCoeff(&at);
  LagEstimate out{static_cast<double>(lags[static_cast<std::size_t>(at)]),
                  costs(at, joint) / std::max(costs(zero, joint), 1e-300), 1 - costs(at, joint) / total};
  if (at > 0 && at + 1 < costs.rows()) {
    const double left = costs(at - 1, joint), top = costs(at, joint), right = costs(at + 1, joint);
    const double bend = left - 2 * top + right;
    const auto stride = static_cast<double>(lags[1] - lags[0]);
    if (bend > 0) out.lag += stride * std::clamp(0.5 * (left - right) / bend, -0.5, 0.5);
  }
  return out;
}

/// The lag that most joints share, in rows; 0 when they share none.
double common_lag(const MotionRegression& regression, const SmoothedLog& smooth, Index most) {
  const Index stride = std::max<Index>(1, most / 30);
  std::vector<Index> lags;
  for (Index lag = -(most / stride) * stride; lag <= most; lag += stride) lags.push_back(lag);
  MatrixXd costs(static_cast<Index>(lags.size()), smooth.tau.cols());
  Index zero = 0;
  for (std::size_t k = 0; k < lags.size(); ++k) {
    if (lags[k] == 0) zero = static_cast<Index>(k);
    costs.row(static_cast<Index>(k)) = regression.cost(smooth.tau, lags[k]).transpose();
  }
  std::vector<double> found;
  double judged = 0.0, with = 0.0, without = 0.0;
  for (Index j = 0; j < smooth.tau.cols(); ++j) {
    const VectorXd tau = smooth.tau.col(j);
    const double total =
        std::max((tau.array() - tau.mean()).square().mean() * static_cast<double>(regression.rows()), 1e-300);
    const LagEstimate e = best_lag(costs, lags, zero, j, total);
    if (e.explained < explained || std::abs(e.lag) >= static_cast<double>(most)) continue;
    ++judged;
    found.push_back(e.lag);
    with += e.gain * costs(zero, j) / total;
    without += costs(zero, j) / total;
  }
  if (found.size() < 2 && smooth.tau.cols() > 1) return 0.0;
  if (found.empty() || with > clear_gain * without) return 0.0;
  const double lag = median(found);
  double agree = 0.0;
  for (const double one : found) agree += std::abs(one - lag) <= std::max(2.0, 0.25 * std::abs(lag));
  return agree >= 0.6 * judged ? lag : 0.0;
}

// Signs

struct SignEvidence {
  double inertia = 0.0;   ///< Standard deviations by which the joint resists its own acceleration.
  double friction = 0.0;  ///< The same for its motion.
};

SignEvidence sign_evidence(const MotionRegression& regression, const MatrixXd& coefficients, const VectorXd& residual,
                           Index j) {
  const double dof = std::max<double>(1.0, static_cast<double>(regression.rows() - regression.parameters()));
  const double variance = residual.squaredNorm() / dof * fit_autoregression(residual).samples_per_independent();
  const Index a = regression.acceleration(j), v = regression.speed(j), c = regression.direction(j);
  SignEvidence out;
  out.inertia = coefficients(a, j) / std::sqrt(std::max(variance * regression.inverse()(a, a), 1e-300));
  const VectorXd speed = regression.basis().col(v), direction = regression.basis().col(c);
  const double n = static_cast<double>(speed.size());
  const double pv = speed.squaredNorm() / n, pc = speed.dot(direction) / n;
  const double power = coefficients(v, j) * pv + coefficients(c, j) * pc;
  const double power_variance = pv * pv * regression.inverse()(v, v) + 2 * pv * pc * regression.inverse()(v, c) +
                                pc * pc * regression.inverse()(c, c);
  out.friction = power / std::sqrt(std::max(variance * power_variance, 1e-300));
  return out;
}

void check_signs(const OrderedLog& data, const MotionRegression& regression, const MatrixXd& coefficients,
                 const MatrixXd& residuals, std::vector<LogFinding>& out) {
  for (Index j = 0; j < data.log.q.cols(); ++j) {
    const auto x = data.log.q.col(j);
    if (x.maxCoeff() - x.minCoeff() < 0.05) continue;
    const SignEvidence e = sign_evidence(regression, coefficients, residuals.col(j), j);
    const bool wrong = (e.friction < -sure_sigmas && e.inertia < sure_sigmas) ||
                       (e.inertia < -sure_sigmas && e.friction < -0.5 * sure_sigmas);
    if (!wrong) continue;
    LogFinding f =
        finding_at(data, LogFault::ReversedTorque, LogSeverity::Error, data.log.tau_name(j), j, 0, data.rows() - 1);
    f.value = std::min(e.friction, e.inertia);
    f.text = f.column + ": reversed against the motion of " + data.log.q_name(j) +
             ": its friction drives the joint and its inertia pushes back (" + short_number(e.friction) + " and " +
             short_number(e.inertia) + " standard deviations); reverse the torque, or the position of this joint";
    out.push_back(f);
  }
}

// Brakes

struct RestSpan {
  Index first, last;
};

std::vector<RestSpan> rest_spans(const OrderedLog& data) {
  const MatrixXd& q = data.log.q;
  std::vector<RestSpan> out;
  Index start = 0;
  for (Index i = 1; i <= q.rows(); ++i) {
    const bool still = i < q.rows() && (q.row(i) - q.row(start)).cwiseAbs().maxCoeff() < resting;
    if (still) continue;
    if (data.log.t[i - 1] - data.log.t[start] >= shortest_rest) out.push_back({start, i - 1});
    start = i;
  }
  return out;
}

void check_brakes(OrderedLog& data, const MotionRegression& regression, const MatrixXd& coefficients,
                  const MatrixXd& residuals, std::vector<LogFinding>& out) {
  VectorXd correlation(residuals.cols());
  for (Index j = 0; j < correlation.size(); ++j)
    correlation[j] = fit_autoregression(residuals.col(j)).samples_per_independent();
  for (const RestSpan& s : rest_spans(data)) {
    const Index middle = (s.first + s.last) / 2;
    const VectorXd needed = regression.predict(coefficients, middle);
    const double leverage = regression.leverage(middle);
    std::string columns;
    Index worst = -1;
    double farthest = 0.0;
    for (Index j = 0; j < needed.size(); ++j) {
      const double level = data.log.tau.col(j).segment(s.first, s.last - s.first + 1).mean();
      const double spread_of_one = residuals.col(j).squaredNorm() / static_cast<double>(regression.rows());
      const double sigma = std::sqrt(spread_of_one * (1 + leverage * correlation[j]));
      const double friction = std::abs(coefficients(regression.direction(j), j));
      const double spread = data.log.tau.col(j).maxCoeff() - data.log.tau.col(j).minCoeff();
      const double off = std::abs(level - needed[j]);
      const bool fell = std::abs(level) < 0.5 * std::abs(needed[j]);
      if (!fell || off < sure_sigmas * sigma + 1.5 * friction || off < 0.15 * spread) continue;
      columns += (columns.empty() ? "" : ", ") + data.log.tau_name(j);
      if (off > farthest) farthest = off, worst = j;
    }
    if (worst < 0) continue;
    std::fill(data.faulty.begin() + s.first, data.faulty.begin() + s.last + 1, char{1});
    LogFinding f =
        finding_at(data, LogFault::Brake, LogSeverity::Error, data.log.tau_name(worst), worst, s.first, s.last);
    f.value = data.log.tau.col(worst).segment(s.first, s.last - s.first + 1).mean();
    f.text = columns + ": at rest from " + short_number(f.begin) + " to " + short_number(f.end) + " s, " +
             data.log.tau_name(worst) + " is " + short_number(f.value) + " where the motion requires " +
             short_number(needed[worst]) + ": the brakes hold; leave the span out (leave_out_faulty)";
    out.push_back(f);
  }
}

// Size

void check_sizes(const OrderedLog& data, const ConditioningOptions& options, std::vector<LogFinding>& out) {
  std::vector<double> ratios;
  for (Index j = 0; j < options.expected_torque.size(); ++j) {
    const double rms = std::sqrt(data.log.tau.col(j).squaredNorm() / static_cast<double>(data.rows()));
    if (options.expected_torque[j] > 0.02 * options.expected_torque.maxCoeff() && rms > 0)
      ratios.push_back(rms / options.expected_torque[j]);
  }
  if (ratios.empty()) return;
  const double ratio = median(ratios);
  if (ratio > 0.2 && ratio < 20) return;
  LogFinding f =
      finding_at(data, LogFault::CurrentForTorque, LogSeverity::Warning, data.log.tau_name(0), 0, 0, data.rows() - 1);
  f.joint = 0;
  f.value = ratio;
  f.text = data.log.tau_name(0) + " to " + data.log.tau_name(data.log.tau.cols() - 1) + ": " + short_number(ratio) +
           " times what the assumed masses require; are these motor currents, torques on the motor side, or N mm?";
  out.push_back(f);
}

}  // namespace

MotionRegression::MotionRegression(const SmoothedLog& smooth, std::vector<Index> rows)
    : smooth_(smooth), rows_(std::move(rows)), joints_(smooth.q.cols()) {
  const VectorXd low = smooth.q.colwise().minCoeff().transpose(), high = smooth.q.colwise().maxCoeff().transpose();
  middle_ = 0.5 * (low + high);
  half_range_ = (0.5 * (high - low)).cwiseMax(1e-3);
  speed_scale_ = smooth.qd.cwiseAbs().colwise().maxCoeff().transpose().cwiseMax(1e-6);
  still_ = 0.03 * speed_scale_;
  acceleration_scale_ = smooth.qdd.cwiseAbs().colwise().maxCoeff().transpose().cwiseMax(1e-6);
  first_speed_ = 1 + joints_ + joints_ * (joints_ + 1) / 2;
  basis_.resize(static_cast<Index>(rows_.size()), first_speed_ + 3 * joints_);
  for (std::size_t k = 0; k < rows_.size(); ++k) basis_.row(static_cast<Index>(k)) = basis_row(rows_[k]).transpose();
  MatrixXd normal = basis_.transpose() * basis_;
  normal.diagonal().array() += 1e-9 * static_cast<double>(rows_.size());  // joints that stand
  inverse_ = normal.ldlt().solve(MatrixXd::Identity(normal.rows(), normal.cols()));
}

VectorXd MotionRegression::basis_row(Index row) const {
  const VectorXd x = (smooth_.q.row(row).transpose() - middle_).cwiseQuotient(half_range_);
  VectorXd out(basis_.cols());
  out[0] = 1.0;
  out.segment(1, joints_) = x;
  Index at = 1 + joints_;
  for (Index i = 0; i < joints_; ++i)
    for (Index k = i; k < joints_; ++k) out[at++] = x[i] * x[k];
  for (Index j = 0; j < joints_; ++j) {
    out[speed(j)] = smooth_.qd(row, j) / speed_scale_[j];
    out[direction(j)] = std::tanh(smooth_.qd(row, j) / still_[j]);
    out[acceleration(j)] = smooth_.qdd(row, j) / acceleration_scale_[j];
  }
  return out;
}

MatrixXd MotionRegression::torques(const MatrixXd& tau, Index lag) const {
  MatrixXd out(rows(), tau.cols());
  for (std::size_t k = 0; k < rows_.size(); ++k) out.row(static_cast<Index>(k)) = tau.row(rows_[k] + lag);
  return out;
}

VectorXd MotionRegression::cost(const MatrixXd& tau, Index lag) const {
  const MatrixXd y = torques(tau, lag);
  const MatrixXd projected = basis_.transpose() * y;
  return y.colwise().squaredNorm().transpose() -
         projected.cwiseProduct(inverse_ * projected).colwise().sum().transpose();
}

MatrixXd MotionRegression::coefficients(const MatrixXd& tau, Index lag) const {
  return inverse_ * (basis_.transpose() * torques(tau, lag));
}

VectorXd MotionRegression::predict(const MatrixXd& coefficients, Index row) const {
  return coefficients.transpose() * basis_row(row);
}

double MotionRegression::leverage(Index row) const {
  const VectorXd b = basis_row(row);
  return b.dot(inverse_ * b);
}

void check_torques(OrderedLog& data, const SmoothedLog& smooth, const ConditioningOptions& options,
                   std::vector<LogFinding>& out) {
  check_sizes(data, options, out);
  const Index most = std::min<Index>(static_cast<Index>(max_torque_delay / data.step), data.rows() / 6);
  std::vector<Index> rows = moving_rows(smooth, most);
  const Index joints = smooth.q.cols();
  if (static_cast<Index>(rows.size()) < 3 * (1 + 4 * joints + joints * (joints + 1) / 2)) return;
  const MotionRegression regression(smooth, std::move(rows));
  const double lag = common_lag(regression, smooth, most) - options.torque_delay / data.step;
  if (std::abs(lag) > 2 && std::abs(lag * data.step) > 2e-3) {
    LogFinding f =
        finding_at(data, LogFault::TorqueDelay, LogSeverity::Error, data.log.tau_name(0), 0, 0, data.rows() - 1);
    f.joint = 0;
    f.value = lag * data.step;
    f.text = data.log.tau_name(0) + " to " + data.log.tau_name(joints - 1) + ": " + short_number(1e3 * f.value) +
             " ms later than the positions: two clocks; state torque_delay " +
             short_number(f.value + options.torque_delay);
    out.push_back(f);
  }
  const auto shift = static_cast<Index>(std::lround(lag + options.torque_delay / data.step));
  const MatrixXd coefficients = regression.coefficients(smooth.tau, shift);
  const MatrixXd residuals = regression.torques(smooth.tau, shift) - regression.basis() * coefficients;
  check_signs(data, regression, coefficients, residuals, out);
  check_brakes(data, regression, coefficients, residuals, out);
}

}  // namespace kr5::identification
