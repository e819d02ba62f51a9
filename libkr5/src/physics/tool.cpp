// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/tool.hpp>

#include <kr5/core/error.hpp>

namespace kr5::physics {

Pose tool_offset(const cell::Cell& cell) {
  Pose T_flange_tool = cell.tool ? cell.tool->T_flange_tool : Pose::Identity();
  T_flange_tool.translate(Eigen::Vector3d(cell.effects.vector("tool_offset", "offset")));
  return T_flange_tool;
}

double payload_mass(const cell::Cell& cell) { return cell.effects.number("payload", "mass"); }

void check_payload(const cell::Cell& cell) {
  require(payload_mass(cell) >= 0.0,
          "effects.payload.tool.mass: must not be negative, found " + std::to_string(payload_mass(cell)) + " kg");
}

kinematics::Body payload(const cell::Cell& cell) {
  const double turning = cell.effects.number("payload", "inertia");
  require(turning == 0.0 || (turning > 0.0 && payload_mass(cell) > 0.0),
          "effects.payload.tool.inertia: must not be negative, and needs a mass; found " + std::to_string(turning) +
              " kg m^2");
  const kinematics::Body tool = {cell.tool->mass, cell.tool->com, cell.tool->inertia};
  const double mass = payload_mass(cell);
  if (mass == 0.0) return tool;
  Vector6 inertia = Vector6::Zero();
  inertia.head<3>().setConstant(turning);
  return kinematics::merged_body(tool, {mass, cell.effects.vector("payload", "com"), inertia});
}

Eigen::Matrix3d R_base_sensor_down() { return Eigen::Vector3d(1, -1, -1).asDiagonal(); }

Eigen::MatrixXd tool_weight(const cell::Cell& cell, Eigen::Index rows) {
  const kinematics::Body load = payload(cell);
  const Eigen::Vector3d weight =
      R_base_sensor_down().transpose() * Eigen::Vector3d(0.0, 0.0, -load.mass * cell.robot.gravity.norm());
  Vector6 wrench;
  wrench << weight, load.com.cross(weight);
  return wrench.transpose().replicate(rows, 1);
}

}  // namespace kr5::physics
