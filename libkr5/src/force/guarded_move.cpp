// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include <kr5/core/error.hpp>
#include <kr5/force/guarded_move.hpp>

namespace kr5::force {

double GuardedMoveOptions::safe_speed() const {
  // touch + stiffness (v delay + v^2 / 2a) = most
  const double room = std::max(most - touch, 0.0) / stiffness, a = acceleration;
  return a * (std::sqrt(delay * delay + 2 * room / a) - delay);
}

void GuardedMoveOptions::validate() const {
  require(speed > 0 && std::isfinite(speed), "speed must be positive [m/s]");
  require(contact_speed >= 0 && std::isfinite(contact_speed), "contact_speed must not be negative [m/s]");
  require(acceleration > 0 && std::isfinite(acceleration), "acceleration must be positive [m/s^2]");
  require(touch > 0 && std::isfinite(touch), "touch must be positive [N]");
  require(most > touch, "most must be more than touch [N]");
  require(stiffness > 0 && std::isfinite(stiffness), "stiffness must be positive [N/m]");
  require(delay >= 0 && std::isfinite(delay), "delay must not be negative [s]");
}

GuardedMove::GuardedMove(const GuardedMoveOptions& options) : options_(options) {
  options.validate();
  slow_ = std::min(options.safe_speed(), options.speed);
  if (options.contact_speed > 0) slow_ = std::min(slow_, options.contact_speed);
}

double GuardedMove::step(double way, double force) noexcept {
  touched_ = touched_ || !(force < options_.touch);  // a force that is no number stops, too
  if (touched_) return 0.0;
  if (!(way > 0)) return slow_;
  return std::clamp(std::sqrt(slow_ * slow_ + 1.6 * options_.acceleration * way), slow_, options_.speed);
}

}  // namespace kr5::force
