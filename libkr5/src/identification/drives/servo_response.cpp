// SPDX-License-Identifier: BSD-3-Clause
#include "identification/drives/servo_response.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/physics/second_order.hpp>

namespace kr5::identification {

using Eigen::Index;
using Eigen::VectorXd;
using physics::RowRange;

Eigen::Matrix<double, Eigen::Dynamic, 2> servo_response(const cell::SecondOrder& servo, const ServoLog& log,
                                                        const std::vector<RowRange>& runs, CommandShape shape) {
  Eigen::Matrix<double, Eigen::Dynamic, 2> out(log.t.size(), 2);
  for (const RowRange& run : runs) {
    const Index n = run.last - run.first;
    const auto t = log.t.segment(run.first, n), command = log.command.segment(run.first, n);
    const auto all = shape == CommandShape::Held ? physics::follow_held(servo, t, command)
                                                 : physics::follow_smooth(servo, t, command);
    out.middleRows(run.first, n) = all.leftCols<2>();
  }
  return out;
}

double median_cycle(const ServoLog& log, const std::vector<RowRange>& runs) {
  std::vector<double> steps;
  for (const RowRange& run : runs)
    for (Index i = run.first + 1; i < run.last; ++i) steps.push_back(log.t[i] - log.t[i - 1]);
  return median(std::move(steps));
}

double neighbour_noise(const VectorXd& values, const std::vector<RowRange>& runs) {
  std::vector<double> sizes;
  for (const RowRange& run : runs)
    for (Index i = run.first + 1; i + 1 < run.last; ++i)
      sizes.push_back(std::abs(values[i - 1] - 2 * values[i] + values[i + 1]));
  return mad_to_sigma * median(std::move(sizes)) / std::sqrt(6.0);
}

cell::SecondOrder servo_from_overshoot(double step, double overshoot, double period) {
  require(step > 0 && std::isfinite(step), "step must be positive [m or rad]");
  require(overshoot > 0 && overshoot < step, "overshoot must lie between 0 and the step");
  require(period > 0 && std::isfinite(period), "period must be positive [s]");
  const double decrement = std::log(step / overshoot);
  const double zeta = decrement / std::hypot(decrement, std::numbers::pi);
  return {2 * std::numbers::pi / (period * std::sqrt(1 - zeta * zeta)), zeta, 0.0};
}

namespace {

/// Rows from a jump of the command to its next change or the end of the run, and the size of the jump.
struct CommandStep {
  RowRange rows;
  double size = 0.0;
};

CommandStep largest_step(const ServoLog& log, const std::vector<RowRange>& runs) {
  CommandStep out;
  for (const RowRange& run : runs)
    for (Index i = run.first + 1; i < run.last; ++i) {
      const double jump = log.command[i] - log.command[i - 1];
      if (std::abs(jump) <= std::abs(out.size)) continue;
      Index end = i + 1;
      while (end < run.last && log.command[end] == log.command[i]) ++end;
      out = {{i, end}, jump};
    }
  return out;
}

/// Slopes of straight lines through `width` samples about each one.
VectorXd smoothed_speed(const Eigen::Ref<const VectorXd>& t, const Eigen::Ref<const VectorXd>& x, Index width) {
  VectorXd out = VectorXd::Zero(t.size() - width + 1);
  for (Index i = 0; i < out.size(); ++i) {
    const VectorXd about = t.segment(i, width).array() - t.segment(i, width).mean();
    out[i] = about.dot(x.segment(i, width)) / about.squaredNorm();
  }
  return out;
}

/// Samples about the greatest speed that lie within a part of it.
RowRange stretch_of_greatest(const VectorXd& speed) {
  constexpr double part = 0.95;
  Index at = 0;
  const double limit = part * speed.cwiseAbs().maxCoeff(&at);
  RowRange out{at, at + 1};
  while (out.first > 0 && std::abs(speed[out.first - 1]) >= limit) --out.first;
  while (out.last < speed.size() && std::abs(speed[out.last]) >= limit) ++out.last;
  return out;
}

}  // namespace

std::optional<OvershootReading> read_overshoot(const ServoLog& log, const std::vector<RowRange>& runs,
                                               const ServoResult& found) {
  const CommandStep step = largest_step(log, runs);
  const Index n = step.rows.last - step.rows.first;
  constexpr Index fewest = 10;
  if (n < fewest || step.size == 0.0) return std::nullopt;
  const double sign = step.size > 0 ? 1.0 : -1.0;
  const VectorXd z = sign * log.response.segment(step.rows.first, n);
  const Index tail = std::max<Index>(n / 10, 3);
  const double end = z.tail(tail).mean();
  Index peak = 0;
  OvershootReading out;
  out.step = std::abs(found.gain * step.size);
  out.overshoot = z.maxCoeff(&peak) - end;
  const double since = log.t[step.rows.first + peak] - log.t[step.rows.first] - found.servo.delay;
  const bool settled = std::abs(z.tail(tail).minCoeff() - z.tail(tail).maxCoeff()) < out.overshoot;
  constexpr double clear = 5.0;  // standard deviations of the noise
  if (!settled || out.overshoot < clear * found.noise || out.overshoot >= out.step || since <= 0) return std::nullopt;
  out.period = 2 * since;
  const cell::SecondOrder servo = servo_from_overshoot(out.step, out.overshoot, out.period);
  out.damping_ratio = servo.damping_ratio;
  out.natural_frequency = servo.natural_frequency;
  const double zeta = std::min(found.servo.damping_ratio, 1 - 1e-9);
  out.second_overshoot = out.step * std::exp(-3 * std::numbers::pi * zeta / std::sqrt(1 - zeta * zeta));
  return out;
}

std::optional<SpeedPlateau> find_speed_plateau(const ServoLog& log, const std::vector<RowRange>& runs,
                                               const ServoResult& found) {
  // Lines through so many samples that noise changes their slopes by a few hundredths of the greatest speed.
  constexpr double fine = 0.02;
  const double noise = neighbour_noise(log.response, runs), wanted = fine * found.max_speed * found.cycle;
  const double least = std::cbrt(12 * noise * noise / (wanted * wanted));
  const Index width = std::max<Index>(5, static_cast<Index>(std::ceil(std::min(least, 1e6))));
  double greatest = 0.0;
  std::optional<SpeedPlateau> out;
  for (const RowRange& run : runs) {
    const Index n = run.last - run.first;
    if (n < 3 * width) continue;
    const auto t = log.t.segment(run.first, n);
    const VectorXd speed = smoothed_speed(t, log.response.segment(run.first, n), width);
    const VectorXd expected = smoothed_speed(t, found.predicted.segment(run.first, n), width);
    if (speed.cwiseAbs().maxCoeff() <= greatest) continue;
    greatest = speed.cwiseAbs().maxCoeff();
    const RowRange seen = stretch_of_greatest(speed), modelled = stretch_of_greatest(expected);
    const Index longer = seen.last - seen.first - 2 * (modelled.last - modelled.first);
    out.reset();
    if (longer > 0) out = {greatest, t[seen.first + width / 2], t[seen.last - 1 + width / 2]};
  }
  return out;
}

}  // namespace kr5::identification
