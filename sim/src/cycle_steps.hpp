// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include <kr5/sim/driven_arm.hpp>

namespace kr5::sim {

/// Sets the step of the arm so that whole steps make a cycle [s]; their number.
inline int divide_cycle(DrivenArm& arm, double cycle) {
  const int steps = static_cast<int>(std::ceil(cycle / arm.step() - 1e-6));
  arm.set_step(cycle / steps);
  return steps;
}

/// The joint servos follow from one setpoint to the next through a cycle. `moved(passed)` is called with the time since
/// the last call [s]: once, or where gears give way, which swing against a contact, step by step, so that what is held
/// and the arm take turns.
void follow_cycle(DrivenArm& arm, const Eigen::VectorXd& from, const Eigen::VectorXd& to, double cycle, auto&& moved) {
  const int steps = divide_cycle(arm, cycle);
  const bool stiff = arm.drives().rigid();
  for (int i = 1; i <= steps; ++i) {
    arm.follow(from + (to - from) * i / steps);
    if (stiff && i < steps) continue;
    moved(stiff ? cycle : cycle / steps);
  }
}

}  // namespace kr5::sim
