// SPDX-License-Identifier: BSD-3-Clause
#include "ik_solver.hpp"

namespace kr5::sim {

IkSolver::IkSolver(const cell::Cell& cell) : chain_(cell::nominal_chain(cell)) {
  if (!cell.robot.limits) return;
  options_.lower = cell.robot.limits->lower;
  options_.upper = cell.robot.limits->upper;
}

std::optional<Eigen::VectorXd> IkSolver::posture(const Pose& T_base_flange, const Eigen::VectorXd& near) {
  options_.near = near;
  const kinematics::InverseResult found = kinematics::inverse_kinematics(chain_, T_base_flange, options_);
  status_ = found.status;
  return found.nearest();
}

}  // namespace kr5::sim
