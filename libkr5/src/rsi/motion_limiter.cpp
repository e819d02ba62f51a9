// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/motion_limiter.hpp>

#include <algorithm>
#include <cmath>

#include <kr5/core/error.hpp>

namespace kr5::rsi {

void MotionLimits::validate() const {
  require(speed > 0 && std::isfinite(speed), "speed: must be positive [rad/s or m/s]");
  require(acceleration > 0 && std::isfinite(acceleration), "acceleration: must be positive [rad/s^2 or m/s^2]");
  require(total >= 0 && std::isfinite(total), "total: must not be negative [rad or m]");
}

MotionLimiter::MotionLimiter(const MotionLimits& limits, double cycle)
    : cycle_(cycle), total_(limits.total), most_speed_(limits.speed), most_change_(limits.acceleration * cycle) {
  limits.validate();
  require(cycle > 0 && std::isfinite(cycle), "cycle: must be positive [s]");
}

double MotionLimiter::stoppable(double distance) const noexcept {
  // With u in units of the change in a cycle, this cycle and those of braking cover u + (u-1) + ... + (u-n), n =
  // floor(u).
  const double r = std::max(distance, 0.0) / (most_change_ * cycle_);
  const double n = std::floor((std::sqrt(1.0 + 8.0 * r) - 1.0) / 2.0);
  return most_change_ * (r + n * (n + 1.0) / 2.0) / (n + 1.0);
}

double MotionLimiter::to_speed(double wanted) noexcept {
  const double low = std::max({speed_ - most_change_, -most_speed_, -stoppable(total_ + value_)});
  const double high = std::min({speed_ + most_change_, most_speed_, stoppable(total_ - value_)});
  const double before = value_;
  value_ = std::clamp(before + cycle_ * std::min(std::max(wanted, low), high), -total_, total_);
  speed_ = (value_ - before) / cycle_;
  return value_;
}

double MotionLimiter::follow(double demand) noexcept {
  if (!std::isfinite(demand)) return brake();
  const double next = std::clamp(demand, -total_, total_);
  const double behind = demand_ - value_;
  const double closing = std::copysign(stoppable(std::abs(behind)), behind);
  const double wanted = (next - demand_) / cycle_ + closing;
  demand_ = next;
  return to_speed(wanted);
}

double MotionLimiter::move(double way) noexcept {
  if (!std::isfinite(way)) return brake();
  demand_ = to_speed(way / cycle_);
  return value_;
}

double MotionLimiter::brake() noexcept {
  demand_ = to_speed(0.0);
  return value_;
}

void MotionLimiter::stand(double value) noexcept {
  value_ = demand_ = std::isfinite(value) ? std::clamp(value, -total_, total_) : 0.0;
  speed_ = 0.0;
}

void MotionLimiter::recount(double demand) noexcept {
  value_ = 0.0;
  demand_ = demand;
}

}  // namespace kr5::rsi
