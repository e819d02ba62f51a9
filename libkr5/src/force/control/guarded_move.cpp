// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include <kr5/core/error.hpp>
#include <kr5/force/guarded_move.hpp>

namespace kr5::force {

double GuardedMoveOptions::safe_speed() const {
  // touch_force + stiffness (v delay + v^2 / 2a) = max_force
  const double room = std::max(max_force - touch_force, 0.0) / stiffness, a = acceleration;
  return a * (std::sqrt(delay * delay + 2 * room / a) - delay);
}

void GuardedMoveOptions::validate() const {
  require(speed > 0 && speed <= 10, "speed must lie between 0 and 10 m/s");
  require(contact_speed >= 0 && std::isfinite(contact_speed), "contact_speed must not be negative [m/s]");
  require(acceleration > 0 && acceleration <= 1e3, "acceleration must lie between 0 and 1000 m/s^2");
  require(touch_force > 0 && std::isfinite(touch_force), "touch_force must be positive [N]");
  require(max_force > touch_force, "max_force must be more than touch_force [N]");
  require(max_force <= 1e5, "max_force must be at most 1e5 N, so that it is a limit");
  require(stiffness > 0 && std::isfinite(stiffness), "stiffness must be positive [N/m]");
  require(delay >= 0 && std::isfinite(delay), "delay must not be negative [s]");
}

GuardedMove::GuardedMove(const GuardedMoveOptions& options) : options_(options) {
  options.validate();
  slow_ = std::min(options.safe_speed(), options.speed);
  if (options.contact_speed > 0) slow_ = std::min(slow_, options.contact_speed);
}

double GuardedMove::step(double way, double force) noexcept {
  // A force or a distance that is no finite number stops the move, too.
  touched_ = touched_ || !std::isfinite(force) || !std::isfinite(way) || force >= options_.touch_force;
  if (touched_) return 0.0;
  if (way <= 0) return slow_;
  return std::clamp(std::sqrt(slow_ * slow_ + 1.6 * options_.acceleration * way), slow_, options_.speed);
}

}  // namespace kr5::force
