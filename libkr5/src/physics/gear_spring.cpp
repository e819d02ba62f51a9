// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/gear_spring.hpp>

namespace kr5::physics {
namespace {

constexpr double no_load = 1e-6;  // what rounding leaves of no load [N m or N]

}  // namespace

double GearSpring::lead_in_balance(double torque) const {
  if (rigid()) return 0.0;
  return torque / stiffness + (std::abs(torque) < no_load ? 0.0 : std::copysign(0.5 * gap, torque));
}

double GearSpring::lead_at_rest(double torque) const {
  if (rigid()) return 0.0;
  const double side = std::abs(torque) > side_torque ? std::copysign(0.5 * gap, torque) : 0.0;
  return (sags ? torque / stiffness : 0.0) + side;
}

GearSpring joint_elasticity(const cell::Cell& cell, int joint) {
  const cell::Gears& gears = cell.robot.gears;
  return {cell.effects.number("joint_elasticity", "stiffness", joint), cell.effects.number("backlash", "gap", joint),
          gears.elastic_damping, gears.side_torque, true};
}

GearSpring backlash(const cell::Cell& cell, int joint) {
  const cell::Gears& gears = cell.robot.gears;
  return {gears.stiffness_of(joint), cell.effects.number("backlash", "gap", joint), gears.backlash_damping,
          gears.side_torque, false};
}

GearSpring gear_spring(const cell::Cell& cell, int joint) {
  const GearSpring elastic = joint_elasticity(cell, joint);
  if (std::isfinite(elastic.stiffness)) return elastic;
  if (cell.effects.number("backlash", "gap", joint) > 0.0) return backlash(cell, joint);
  return {};
}

}  // namespace kr5::physics
