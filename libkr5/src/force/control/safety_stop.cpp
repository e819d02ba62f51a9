// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/force/safety_stop.hpp>

#include <algorithm>
#include <cmath>

#include <kr5/core/error.hpp>

namespace kr5::force {

void SafetyLimits::validate() const {
  // Beyond these no value of a robot cell is a limit.
  require(force > 0 && force <= 1e5, "force must lie between 0 and 1e5 N, so that it is a limit");
  require(torque > 0 && torque <= 1e5, "torque must lie between 0 and 1e5 N m, so that it is a limit");
  require((current.array() > 0).all() && (current.array() <= 1e4).all(),
          "current: every limit must be positive, and at most 1e4 A, so that it is a limit");
  require(dead_after >= 0 && dead_after <= 60, "dead_after must lie between 0 and 60 s");
  require(cycle > 0 && cycle <= 10, "cycle must lie between 0 and 10 s");
}

SafetyStop::SafetyStop(const SafetyLimits& limits) : limits_(limits) { limits.validate(); }

void SafetyStop::reset() noexcept {
  same_ = 0;
  latched_ = Violation::None;
}

Violation SafetyStop::find_violation(const Vector6& raw, const Vector6& wrench, std::span<const double> current,
                                     bool saturated) noexcept {
  same_ = raw == last_ ? same_ + 1 : 0;
  last_ = raw;
  if (saturated) return Violation::SensorSaturated;
  if (!raw.allFinite() || !wrench.allFinite()) return Violation::SensorDead;
  if (wrench.head<3>().norm() > limits_.force) return Violation::Force;
  if (wrench.tail<3>().norm() > limits_.torque) return Violation::Torque;
  if (limits_.dead_after > 0 && same_ * limits_.cycle >= limits_.dead_after) return Violation::SensorDead;
  if (limits_.current.size() == 0) return Violation::None;
  if (current.size() != static_cast<std::size_t>(limits_.current.size())) return Violation::Current;  // not told
  for (std::size_t i = 0; i < current.size(); ++i)
    if (!(std::abs(current[i]) <= limits_.current[static_cast<Eigen::Index>(i)])) return Violation::Current;
  return Violation::None;
}

Violation SafetyStop::step(const Vector6& raw, const Vector6& wrench, std::span<const double> current,
                           bool saturated) noexcept {
  const Violation now = find_violation(raw, wrench, current, saturated);
  if (latched_ == Violation::None) latched_ = now;
  return latched_;
}

void CurrentLimitOptions::validate() const {
  require(margin >= 0 && std::isfinite(margin), "margin must not be negative");
  require(min_limit >= 0 && std::isfinite(min_limit), "min_limit must not be negative [A]");
}

Eigen::VectorXd current_limits(const Eigen::VectorXd& gravity, const Eigen::VectorXd& friction,
                               const CurrentLimitOptions& options) {
  options.validate();
  require(gravity.size() == friction.size(), "friction: found " + std::to_string(friction.size()) +
                                                 " values, expected one a motor: " + std::to_string(gravity.size()));
  require(gravity.allFinite(), "gravity holds a number that is not finite [A]");
  require(friction.allFinite() && (friction.array() >= 0).all(), "friction must not be negative [A]");
  return ((1 + options.margin) * (gravity.cwiseAbs() + friction)).cwiseMax(options.min_limit);
}

}  // namespace kr5::force
