// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/measured_positions.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/identification/log_conditioning.hpp>
#include <kr5/identification/zero_phase.hpp>
#include <kr5/physics/cubic_spline.hpp>

namespace kr5::arm_log {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double highest_cutoff = 0.45;  // of the rate of the log, above which nothing is left to smooth away
constexpr double edge_periods = 2.0;     // of the cut-off at the ends of a log
constexpr double rows_per_period = 20;   // of the cut-off that are kept
constexpr Index fewest_positions = 30;   // rows
constexpr double most_even_rows = 5e6;
constexpr double slowest_cutoff = 1e-3;  // [Hz]
constexpr double stop_ringing = 0.01;    // of the RMS speed: what a low-pass rings about stops

/// Values at even steps from the first time to the last, linear between rows.
Positions at_even_steps(const VectorXd& t, const MatrixXd& q, double step) {
  const double span = t[t.size() - 1] - t[0];
  require(span / step + 1 <= most_even_rows, "t: found a span of " + std::to_string(span) + " s at steps of " +
                                                 std::to_string(step) + " s, expected at most 5000000 rows");
  const auto rows = static_cast<Index>(std::ceil((span + step / 2) / step));
  Positions out{VectorXd(rows), MatrixXd(rows, q.cols())};
  Index k = 0;
  for (Index i = 0; i < rows; ++i) {
    out.t[i] = t[0] + static_cast<double>(i) * step;
    const double at = std::min(out.t[i], t[t.size() - 1]);
    while (k + 2 < t.size() && t[k + 1] <= at) ++k;
    out.q.row(i) = q.row(k) + (at - t[k]) / (t[k + 1] - t[k]) * (q.row(k + 1) - q.row(k));
  }
  return out;
}

std::string every_fault() {
  std::string out;
  for (const auto& [fault, name] : enum_names(identification::LogFault{}))
    out += (out.empty() ? "" : ",") + std::string(name);
  return out;
}

}  // namespace

double middle_step(const VectorXd& t) {
  require(t.size() > 1, "t: expected two times or more, found " + std::to_string(t.size()));
  const VectorXd steps = t.tail(t.size() - 1) - t.head(t.size() - 1);
  return median({steps.begin(), steps.end()});
}

Smoothing choose_smoothing(const VectorXd& t, const MatrixXd& q, const MatrixXd& loads) {
  require(q.rows() == t.size() && (loads.size() == 0 || loads.rows() == t.size()),
          "q: expected a row for each of the " + std::to_string(t.size()) + " times");
  require(t.size() >= fewest_positions,
          "found " + std::to_string(t.size()) + " rows of positions without a gap, expected at least " +
              std::to_string(fewest_positions) + "; log a longer motion, or at a higher rate");
  const double step = middle_step(t);
  identification::JointLog log;
  log.t = t;
  log.q = q;
  log.tau = loads.size() > 0 ? loads : MatrixXd::Zero(q.rows(), q.cols());
  identification::ConditioningOptions options;
  options.accept = every_fault();
  const auto found = identification::condition_log(log, options);
  Smoothing out;
  const double span = t[t.size() - 1] - t[0];
  if (found.usable() && found.even_clock) out.even_step = span / static_cast<double>(t.size() - 1);
  const Positions even = at_even_steps(t, q, step);
  const double usual = found.usable() ? found.cutoff : 5 * identification::motion_bandwidth(even.q, step);
  VectorXd noise(q.cols());
  for (Index j = 0; j < q.cols(); ++j) noise[j] = reading_noise(q.col(j));
  out.cutoff = std::min(usual, identification::motion_cutoff(even.q, step, noise));
  out.smooths = out.cutoff > 0 && out.cutoff < highest_cutoff / step;
  out.stride = std::max(1, static_cast<int>(1 / (rows_per_period * std::max(usual, slowest_cutoff) * step)));
  const double gain = identification::speed_noise_gain(step, out.smooths ? out.cutoff : 0.0);
  const MatrixXd speed = identification::central_differences(
      out.smooths ? identification::zero_phase_low_pass(even.q, step, out.cutoff) : even.q, step);
  const VectorXd ringing = stop_ringing * speed.cwiseAbs2().colwise().mean().cwiseSqrt().transpose();
  out.speed_noise = ((gain * noise).array().square() + ringing.array().square()).sqrt();
  return out;
}

Positions smooth_positions(const VectorXd& t, const MatrixXd& q, const Smoothing& smoothing) {
  if (!smoothing.smooths) return {t, q};
  const double step = middle_step(t);
  Positions out = at_even_steps(t, q, step);
  out.q = identification::zero_phase_low_pass(out.q, step, smoothing.cutoff);
  return out;
}

MatrixXd positions_at(const Positions& positions, const VectorXd& t) {
  MatrixXd out(t.size(), positions.q.cols());
  for (Index j = 0; j < out.cols(); ++j) {
    const physics::SplinePieces spline = physics::cubic_spline(positions.t, positions.q.col(j));
    Index k = 0;
    for (Index i = 0; i < t.size(); ++i) {
      while (k + 2 < positions.t.size() && positions.t[k + 1] <= t[i]) ++k;
      out(i, j) = physics::spline_value(spline.row(k), t[i] - positions.t[k]);
    }
  }
  return out;
}

std::vector<Index> kept_rows(const VectorXd& t, const Smoothing& smoothing, const TimeSpan& experiment,
                             const TimeSpan& positions, int most) {
  const double edge = smoothing.smooths ? edge_periods / smoothing.cutoff : 0.0;
  const double low = positions.begin + edge, high = positions.end - edge;
  std::vector<Index> inside;
  for (Index i = 0; i < t.size(); ++i)
    if (t[i] >= experiment.begin && t[i] < experiment.end && t[i] >= low && t[i] <= high) inside.push_back(i);
  const auto count = static_cast<Index>(inside.size());
  const Index stride = most > 0 ? std::max<Index>(smoothing.stride, (count + most - 1) / most) : smoothing.stride;
  std::vector<Index> out;
  for (Index k = 0; k < count; k += stride) out.push_back(inside[static_cast<std::size_t>(k)]);
  return out;
}

}  // namespace kr5::arm_log
