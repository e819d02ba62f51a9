// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/force/force_loop.hpp>

#include <algorithm>
#include <cmath>

#include <kr5/core/error.hpp>

namespace kr5::force {

double ForceLoopOptions::compensator() const {
  const double loop = gain * stiffness;
  return correction == CorrectionReference::Start ? (1 + loop) / loop : 1.0;
}

double ForceLoopOptions::contact_speed(double reference, double cycle) const {
  return gain * std::abs(reference) / cycle;
}

void ForceLoopOptions::validate() const {
  require(gain > 0 && std::isfinite(gain), "gain must be positive [m/N]");
  require(stiffness > 0 && std::isfinite(stiffness), "stiffness must be positive [N/m]");
  require(largest_step >= 0 && largest_step <= 1, "largest_step must lie between 0 and 1 m");
  require(range > 0 && range <= 1, "range must lie between 0 and 1 m");
}

ForceLoop::ForceLoop(const ForceLoopOptions& options) : options_(options) {
  options.validate();
  compensator_ = options.compensator();
}

double ForceLoop::step_limit() const noexcept {
  constexpr double default_part = 0.02;  // of the range, where corrections add up and nothing else bounds them
  if (options_.largest_step > 0) return options_.largest_step;
  return options_.correction == CorrectionReference::Start ? 2 * options_.range : default_part * options_.range;
}

void ForceLoop::reset() noexcept {
  correction_ = 0.0;
  limited_ = false;
}

double ForceLoop::step(double reference, double measured) noexcept {
  const double asked = options_.gain * (compensator_ * reference - measured);
  const bool of_start = options_.correction == CorrectionReference::Start;
  const double before = of_start ? correction_ : 0.0;
  if (!std::isfinite(asked)) {  // a reading that is no finite number moves nothing
    limited_ = true;
    return correction_ = before;
  }
  const double step = step_limit();
  const double next = std::clamp(std::clamp(asked, before - step, before + step), -options_.range, options_.range);
  limited_ = next != asked;
  return correction_ = next;
}

}  // namespace kr5::force
