// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/force/force_loop.hpp>

#include <algorithm>
#include <cmath>

#include <kr5/core/error.hpp>

namespace kr5::force {

double ForceLoopOptions::compensator() const {
  const double loop = gain * stiffness;
  return correction == CorrectionOf::Start ? (1 + loop) / loop : 1.0;
}

double ForceLoopOptions::contact_speed(double wish, double cycle) const { return gain * std::abs(wish) / cycle; }

void ForceLoopOptions::validate() const {
  require(gain > 0 && std::isfinite(gain), "gain must be positive [m/N]");
  require(stiffness > 0 && std::isfinite(stiffness), "stiffness must be positive [N/m]");
  require(largest_step >= 0, "largest_step must not be negative [m]");
  require(range > 0, "range must be positive [m]");
}

ForceLoop::ForceLoop(const ForceLoopOptions& options) : options_(options) {
  options.validate();
  compensator_ = options.compensator();
}

void ForceLoop::reset() noexcept {
  correction_ = 0.0;
  limited_ = false;
}

double ForceLoop::step(double wish, double measured) noexcept {
  const double asked = options_.gain * (compensator_ * wish - measured);
  const bool of_start = options_.correction == CorrectionOf::Start;
  const double before = of_start ? correction_ : 0.0;
  double next = asked;
  if (options_.largest_step > 0)
    next = std::clamp(next, before - options_.largest_step, before + options_.largest_step);
  if (of_start) next = std::clamp(next, -options_.range, options_.range);
  limited_ = next != asked;
  correction_ = std::isfinite(next) ? next : before;  // a reading that is no number moves nothing
  return correction_;
}

}  // namespace kr5::force
