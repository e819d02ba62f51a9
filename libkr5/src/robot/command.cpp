// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/robot/command.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <kr5/core/error.hpp>

namespace kr5::robot {
namespace {

/// `asked`, or as far towards it from `now` as a cycle may go.
Pose within(const Pose& now, const Pose& asked, const CommandLimits& limits) noexcept {
  const Eigen::Vector3d way = asked.translation() - now.translation();
  const Eigen::Vector3d turn = log_rotation(asked.linear() * now.linear().transpose());
  const double distance = way.norm(), angle = turn.norm();
  Pose out = asked;
  if (limits.translation && distance > *limits.translation)
    out.translation() = now.translation() + way * (*limits.translation / distance);
  if (limits.rotation && angle > *limits.rotation)
    out.linear() = exp_rotation(turn * (*limits.rotation / angle)) * now.linear();
  return out;
}

}  // namespace

void CommandLimits::validate() const {
  for (const auto& [value, name] : {std::pair{translation, "translation"}, {rotation, "rotation"}, {joint, "joint"}})
    require(!value || *value >= 0, std::string(name) + ": must not be negative");
}

CommandLimits CommandLimits::within(const CommandLimits& other) const noexcept {
  const auto smaller = [](const std::optional<double>& a, const std::optional<double>& b) {
    return a && b ? std::min(*a, *b) : a ? a : b;
  };
  return {smaller(translation, other.translation), smaller(rotation, other.rotation), smaller(joint, other.joint)};
}

RobotCommand tool_command(const Pose& T_base_tool) noexcept {
  RobotCommand out;
  out.space = CommandSpace::Tool;
  out.tool = T_base_tool;
  return out;
}

RobotCommand tool_motion(const Pose& motion, CommandFrame frame) noexcept {
  RobotCommand out = tool_command(motion);
  out.mode = CommandMode::Relative;
  out.frame = frame;
  return out;
}

Pose commanded_tool(const RobotCommand& command, const Pose& T_base_tool) noexcept {
  if (command.stop || command.space != CommandSpace::Tool || !command.tool.matrix().allFinite()) return T_base_tool;
  Pose asked = command.tool;
  if (command.mode == CommandMode::Relative) {
    if (command.frame == CommandFrame::Tool) {
      asked = T_base_tool * command.tool;
    } else {
      asked.translation() += T_base_tool.translation();
      asked.linear() = command.tool.linear() * T_base_tool.linear();
    }
  }
  return within(T_base_tool, asked, command.limits);
}

JointVector commanded_joints(const RobotCommand& command, const JointVector& joints) noexcept {
  if (command.stop || command.space != CommandSpace::Joints || command.joints.size() != joints.size() ||
      !command.joints.allFinite())
    return joints;
  JointVector out = joints;
  for (Eigen::Index i = 0; i < joints.size(); ++i) {
    const double asked = command.mode == CommandMode::Relative ? joints[i] + command.joints[i] : command.joints[i];
    const double most = command.limits.joint.value_or(std::abs(asked - joints[i]));
    out[i] = std::abs(asked - joints[i]) > most ? joints[i] + std::copysign(most, asked - joints[i]) : asked;
  }
  return out;
}

}  // namespace kr5::robot
