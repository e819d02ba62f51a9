// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/robot/joint_vector.hpp>

/// @file
/// What a robot is told in one cycle: the one output of every controller. Of fixed size: copying it allocates nothing
/// and throws nothing.

namespace kr5::robot {

/// What a command moves.
enum class CommandSpace {
  None,    ///< Nothing: the arm stands.
  Joints,  ///< Each joint.
  Tool,    ///< The tool tip E.
};
constexpr auto enum_names(CommandSpace) {
  using enum CommandSpace;
  return names<CommandSpace>({{None, "none"}, {Joints, "joints"}, {Tool, "tool"}});
}

enum class CommandMode {
  Absolute,  ///< Where it shall be.
  Relative,  ///< A motion from where it is when the command takes effect.
};
constexpr auto enum_names(CommandMode) {
  return names<CommandMode>({{CommandMode::Absolute, "absolute"}, {CommandMode::Relative, "relative"}});
}

/// Axes of a relative motion of the tool; an absolute pose is one in B.
enum class CommandFrame {
  Base,  ///< Translation and rotation about the tool tip, in axes of B.
  Tool,  ///< The same in axes of E.
};
constexpr auto enum_names(CommandFrame) {
  return names<CommandFrame>({{CommandFrame::Base, "base"}, {CommandFrame::Tool, "tool"}});
}

/// The greatest motion in one cycle, where one is stated; the rest of a longer one is not made.
struct CommandLimits {
  std::optional<double> translation = {};  ///< Of the tool tip [m].
  std::optional<double> rotation = {};     ///< Of the tool [rad].
  std::optional<double> joint = {};        ///< Of a joint [rad or m].

  /// @throws InvalidArgument naming the field that is negative, or no number.
  void validate() const;
  /// The smaller of each limit.
  CommandLimits within(const CommandLimits& other) const noexcept;

  static void each_field(auto& self, auto&& visit) {
    visit("translation", self.translation, "Maximum motion of the tool tip in one cycle; without it, not limited [m].");
    visit("rotation", self.rotation, "Maximum rotation of the tool in one cycle; without it, not limited [rad].");
    visit("joint", self.joint, "Maximum motion of a joint in one cycle; without it, not limited [rad or m].");
  }
};

/// What the gripper is told.
struct GripperCommand {
  bool hold = true;      ///< It holds its part; otherwise it lets the part slide along.
  bool air = false;      ///< Compressed air on the part.
  bool fingers = false;  ///< Of a tool with two grippers, the fingers close and not the suction cup.

  static void each_field(auto& self, auto&& visit) {
    visit("hold", self.hold, "True while the gripper holds its part; otherwise the part slides.");
    visit("air", self.air, "True while compressed air pushes the part.");
    visit("fingers", self.fingers,
          "True when the fingers of a tool close that has a suction cup, too; what is held stays held meanwhile.");
  }
};

struct RobotCommand {
  CommandSpace space = CommandSpace::None;
  CommandMode mode = CommandMode::Absolute;
  CommandFrame frame = CommandFrame::Base;
  JointVector joints = {};       ///< Values, or changes of them, for the space joints [rad or m].
  Pose tool = Pose::Identity();  ///< T_base_tool, or the motion of the tool, for the space tool [m].
  CommandLimits limits = {};
  GripperCommand gripper = {};
  bool stop = false;  ///< Stop the arm where it is, whatever else is said.

  static void each_field(auto& self, auto&& visit) {
    visit("space", self.space, "What the command moves: none | joints | tool.");
    visit("mode", self.mode,
          "Meaning of its values: absolute (where it shall be) | relative (motion from where it is).");
    visit("frame", self.frame, "Axes of a relative motion of the tool: base | tool.");
    visit("joints", self.joints, "Joint values, or changes of them, for the space joints [rad or m].");
    visit("tool", self.tool, "T_base_tool, or the motion of the tool, for the space tool [m].");
    visit("limits", self.limits, "Greatest motion in one cycle.");
    visit("gripper", self.gripper, "Command to the gripper.");
    visit("stop", self.stop, "True once the arm must stop at its present position.");
  }
};

/// A command that brings the tool tip to a pose in B.
RobotCommand tool_command(const Pose& T_base_tool) noexcept;
/// A command that moves the tool tip from where it is.
RobotCommand tool_motion(const Pose& motion, CommandFrame frame) noexcept;

/// Where the tool is asked to be after a cycle, within the command's limits, when it is at `T_base_tool`: there, unless
/// the command moves the tool, all its numbers are finite, and it is no stop.
Pose commanded_tool(const RobotCommand& command, const Pose& T_base_tool) noexcept;
/// The same of the joints; they stay, too, when the command has not one value a joint.
JointVector commanded_joints(const RobotCommand& command, const JointVector& joints) noexcept;

}  // namespace kr5::robot
