// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/predict/contact.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <kr5/core/error.hpp>

namespace kr5::predict {

RealContact::RealContact(const cell::Cell& cell)
    : damping_(cell.contact->damping),
      friction_(cell.effects.task.friction.value_or(cell.contact->friction)),
      hardening_(cell.effects.task.hardening * 1e3) {
  const double stiffness = cell.effects.task.stiffness.value_or(cell.contact->stiffness);
  require(stiffness > 0.0, "contact.stiffness: found " + std::to_string(stiffness) + ", expected more than 0 N/m");
  const double axial = cell.effects.task.axial;
  stiffness_ = axial == 0.0 ? stiffness : 1.0 / (1.0 / stiffness + axial);
}

double RealContact::force(double depth, double speed) const {
  if (depth <= 0.0) return 0.0;
  return std::max(stiffness_ * depth * (1.0 + hardening_ * depth) + damping_ * speed, 0.0);
}

double RealContact::depth(double force) const {
  const double p = force / stiffness_;  // of a linear spring
  if (hardening_ == 0.0) return p;
  const double root = 1.0 + 4.0 * hardening_ * p;
  return root >= 0.0 ? 2.0 * p / (1.0 + std::sqrt(root)) : std::numeric_limits<double>::quiet_NaN();
}

Pose real_tube(const cell::TaskEffects& effects) {
  Pose out(Eigen::Translation3d(effects.tube_shift));
  out.rotate(Eigen::AngleAxisd(effects.tube_tilt.x(), Eigen::Vector3d::UnitX()));
  out.rotate(Eigen::AngleAxisd(effects.tube_tilt.y(), Eigen::Vector3d::UnitY()));
  return out;
}

double real_inner_radius(const cell::Cell& cell) {
  return cell.effects.task.tube_radius.value_or(cell.tube->inner_radius);
}

Eigen::MatrixXd tool_weight(const cell::Cell& cell, Eigen::Index rows) {
  const cell::ToolEffects& e = cell.effects.tool;
  const double g = cell.robot.gravity.norm();
  const Eigen::Vector3d moment = (cell.tool->mass * cell.tool->com + e.payload_mass * e.payload_com) * g;
  Eigen::RowVectorXd w(6);
  w << 0.0, 0.0, (cell.tool->mass + e.payload_mass) * g, moment.y(), -moment.x(), 0.0;
  return w.replicate(rows, 1);
}

}  // namespace kr5::predict
