// SPDX-License-Identifier: BSD-3-Clause
#include "reach.hpp"

namespace kr5::sim {

Reach::Reach(const cell::Cell& cell) : chain_(cell::chain(cell)) {
  if (!cell.robot.limits) return;
  options_.lower = cell.robot.limits->lower;
  options_.upper = cell.robot.limits->upper;
}

std::optional<Eigen::VectorXd> Reach::posture(const Pose& T_B_F, const Eigen::VectorXd& near) {
  options_.near = near;
  const kinematics::InverseResult found = kinematics::inverse(chain_, T_B_F, options_);
  status_ = found.status;
  std::optional<Eigen::VectorXd> best;
  for (const kinematics::Posture& p : found.postures)
    if (p.usable() && (!best || (p.q - near).norm() < (*best - near).norm())) best = p.q;
  return best;
}

}  // namespace kr5::sim
