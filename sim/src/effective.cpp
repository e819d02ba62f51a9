// SPDX-License-Identifier: BSD-3-Clause
#include "effective.hpp"

#include <cmath>

#include <kr5/predict/contact.hpp>

namespace kr5::sim {
std::vector<kinematics::DhJoint> effective_joints(const cell::Cell& cell, double t) {
  const cell::ArmEffects& arm = cell.effects.arm;
  const double scale = arm.growth == 0.0 ? 1.0 : 1.0 + arm.growth * -std::expm1(-t / arm.growth_time_constant);
  std::vector<kinematics::DhJoint> joints = cell.robot.dh;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const cell::JointEffects& effects = cell.effects.joint(static_cast<int>(i));
    joints[i].a = effects.a.value_or(joints[i].a) * scale;
    joints[i].b = effects.b.value_or(joints[i].b) * scale;
    joints[i].alpha = effects.alpha.value_or(joints[i].alpha);
  }
  return joints;
}

Pose effective_base(const cell::Cell& cell) {
  const cell::ArmEffects& arm = cell.effects.arm;
  Vector6 tilt = Vector6::Zero();
  tilt[3] = arm.base_roll;
  tilt[4] = arm.base_pitch;
  return from_xyzrpy(tilt) * cell.robot.T_B_0;
}

kinematics::Body effective_tool(const cell::Cell& cell) {
  const kinematics::Body tool{cell.tool->mass, cell.tool->com, cell.tool->inertia};
  const cell::ToolEffects& effects = cell.effects.tool;
  return kinematics::combined(tool, {effects.payload_mass, effects.payload_com, Vector6::Zero()});
}

force::PegTubeShape real_shape(const cell::Cell& cell) {
  const cell::Peg& peg = *cell.peg;
  const cell::Tube& tube = *cell.tube;
  return {peg.radius,        peg.length, peg.chamfer, predict::real_inner_radius(cell),
          tube.outer_radius, tube.depth, tube.chamfer};
}

}  // namespace kr5::sim
