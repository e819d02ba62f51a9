// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include <kr5/cell/cell.hpp>
#include <kr5/kinematics/inverse.hpp>

namespace kr5::work {

/// Where the arm of a cell comes to with its tool, within its limits.
class Reach {
 public:
  explicit Reach(const cell::Cell& believed)
      : chain_(cell::nominal_chain(believed)), T_tool_flange_(believed.tool->T_flange_tool.inverse()) {
    if (believed.robot.limits) {
      options_.lower = believed.robot.limits->lower;
      options_.upper = believed.robot.limits->upper;
    }
    options_.near = Eigen::VectorXd::Zero(believed.robot.joints());
  }

  bool of(const Pose& T_base_tool) const { return posture(T_base_tool).has_value(); }
  /// The joints nearest to zero at a pose of the tool; none where the arm does not come to it [rad or m].
  std::optional<Eigen::VectorXd> posture(const Pose& T_base_tool) const {
    return kinematics::inverse_kinematics(chain_, T_base_tool * T_tool_flange_, options_).nearest();
  }

 private:
  kinematics::DhChain chain_;
  Pose T_tool_flange_;
  kinematics::InverseOptions options_;
};

}  // namespace kr5::work
