// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/tool.hpp>

namespace kr5::physics {

Pose tool_offset(const cell::Cell& cell) {
  Pose T_flange_tool = cell.tool ? cell.tool->T_flange_tool : Pose::Identity();
  T_flange_tool.translate(Eigen::Vector3d(cell.effects.vector("tool_offset", "offset")));
  return T_flange_tool;
}

double payload_mass(const cell::Cell& cell) { return cell.effects.number("payload", "mass"); }

kinematics::Body payload(const cell::Cell& cell) {
  const kinematics::Body tool = {cell.tool->mass, cell.tool->com, cell.tool->inertia};
  const double mass = payload_mass(cell);
  if (mass == 0.0) return tool;
  return kinematics::merged_body(tool, {mass, cell.effects.vector("payload", "com"), Vector6::Zero()});
}

Eigen::MatrixXd tool_weight(const cell::Cell& cell, Eigen::Index rows) {
  const kinematics::Body load = payload(cell);
  const double weight = load.mass * cell.robot.gravity.norm();
  Eigen::RowVectorXd w(6);
  w << 0.0, 0.0, weight, weight * load.com.y(), -weight * load.com.x(), 0.0;
  return w.replicate(rows, 1);
}

}  // namespace kr5::physics
