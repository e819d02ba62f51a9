// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/force/safety_stop.hpp>

#include <algorithm>
#include <cmath>

#include <kr5/core/error.hpp>

namespace kr5::force {

void SafetyLimits::validate() const {
  require(force > 0, "force must be positive [N]");
  require(torque > 0, "torque must be positive [N m]");
  require((current.array() > 0).all(), "current: every limit must be positive [A]");
  require(dead_after >= 0 && std::isfinite(dead_after), "dead_after must not be negative [s]");
  require(cycle > 0 && std::isfinite(cycle), "cycle must be positive [s]");
}

SafetyStop::SafetyStop(const SafetyLimits& limits) : limits_(limits) { limits.validate(); }

void SafetyStop::reset() noexcept {
  same_ = 0;
  latched_ = Violation::None;
}

Violation SafetyStop::judge(const Vector6& raw, const Vector6& wrench, std::span<const double> current,
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
  const Violation now = judge(raw, wrench, current, saturated);
  if (latched_ == Violation::None) latched_ = now;
  return latched_;
}

void CurrentLimitOptions::validate() const {
  require(margin >= 0 && std::isfinite(margin), "margin must not be negative");
  require(least >= 0 && std::isfinite(least), "least must not be negative [A]");
}

Eigen::VectorXd current_limits(const Eigen::VectorXd& gravity, const Eigen::VectorXd& friction,
                               const CurrentLimitOptions& options) {
  options.validate();
  require(gravity.size() == friction.size(), "friction: found " + std::to_string(friction.size()) +
                                                 " values, expected one a motor: " + std::to_string(gravity.size()));
  require(gravity.allFinite(), "gravity holds a number that is not finite [A]");
  require(friction.allFinite() && (friction.array() >= 0).all(), "friction must not be negative [A]");
  return ((1 + options.margin) * (gravity.cwiseAbs() + friction)).cwiseMax(options.least);
}

}  // namespace kr5::force
