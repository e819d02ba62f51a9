// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include <kr5/cell/simulator.hpp>

namespace kr5::predict {

class MotionCache;

/// The longest step in which an arm is moved by torque servos; stiff servos ask for shorter ones [s].
inline constexpr double servo_arm_step = 0.005;

/// The fast grade of a simulator: inverse dynamics on the response of the servos, closed-form contact, projection. All
/// effects of the catalogue act as the documentation of the formats states (kr5/cell/effects.hpp lists them).
///
/// The small deflections of elastic joints and of backlash come from equations of motion linearised about the motors'
/// motion. What a sensor cannot see is NaN: a point behind the camera, a ray that meets nothing, a peg that nothing
/// carries.
///
/// Remembers the motions it predicted last (up to about 72 MB), as effects that are compared share most of what they
/// cost; the answers are the same. One object may be used by many threads; copies share what they remember.
class FastSimulator : public cell::Simulator {
 public:
  FastSimulator();
  /// @throws InvalidArgument as for Simulator; for a given value that is not finite; for an effect on a joint,
  ///         motor or part that the cell does not have.
  io::Table simulate(const cell::Cell& cell, const cell::Experiment& experiment) const override;

 private:
  std::shared_ptr<MotionCache> cache_;
};

}  // namespace kr5::predict
