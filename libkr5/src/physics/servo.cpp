// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/servo.hpp>

#include <kr5/core/error.hpp>

namespace kr5::physics {

double joint_servo(const cell::Cell& cell, int joint) {
  return cell.effects.replaced_number("joint_servo", "natural_frequency", joint)
      .value_or(cell.servo->of_joint(joint).natural_frequency);
}

double joint_delay(const cell::Cell& cell, int joint) {
  return cell.effects.replaced_number("joint_delay", "delay").value_or(cell.servo->of_joint(joint).delay);
}

double tool_servo(const cell::Cell& cell) {
  return cell.effects.replaced_number("tool_servo", "natural_frequency").value_or(cell.servo->tool->natural_frequency);
}

double tool_damping(const cell::Cell& cell) {
  return cell.effects.replaced_number("tool_damping", "damping_ratio").value_or(cell.servo->tool->damping_ratio);
}

double tool_delay(const cell::Cell& cell) {
  return cell.effects.replaced_number("tool_delay", "delay").value_or(cell.servo->tool->delay);
}

std::vector<cell::SecondOrder> joint_servos(const cell::Cell& cell) {
  std::vector<cell::SecondOrder> out;
  if (!cell.servo || cell.servo->joint.empty()) return out;
  for (int i = 0; i < cell.robot.joints(); ++i) {
    out.push_back({joint_servo(cell, i), cell.servo->of_joint(i).damping_ratio, joint_delay(cell, i)});
    require(out.back().natural_frequency > 0.0, "servo.joint.natural_frequency of joint " + std::to_string(i + 1) +
                                                    " is not positive: found " +
                                                    std::to_string(out.back().natural_frequency));
  }
  return out;
}

cell::SecondOrder path_servo(const cell::Cell& cell) {
  return {tool_servo(cell), tool_damping(cell), tool_delay(cell)};
}

}  // namespace kr5::physics
