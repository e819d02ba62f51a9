// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include <kr5/rsi/controller_state.hpp>
#include <kr5/rsi/motion_limiter.hpp>
#include <kr5/rsi/rotation_limiter.hpp>

/// @file
/// From commands to corrections of the controller's path, within limits that hold whoever asks.

namespace kr5::rsi {

struct CorrectionLimits {
  MotionLimits axis = {0.2, 2.0, 0.0873};         ///< [rad/s, rad/s^2, rad]
  std::vector<MotionLimits> axes = {};            ///< The same of each joint, where they differ.
  MotionLimits translation = {0.05, 0.5, 0.005};  ///< [m/s, m/s^2, m]
  MotionLimits rotation = {0.2, 2.0, 0.0873};     ///< [rad/s, rad/s^2, rad]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("axis", self.axis, "Limits of every joint [rad or m].");
    visit("axes", self.axes, "Limits of each joint, instead of those of every one; empty: they are alike.");
    visit("translation", self.translation, "Limits of X, Y and Z of a Cartesian correction, each [m].");
    visit("rotation", self.rotation,
          "Limits of the three components of its rotation vector, each; a total of pi or more: any orientation [rad].");
  }
};

/// What became of a command.
enum class CommandOutcome {
  Followed,  ///< Exactly.
  Limited,   ///< As far as the limits allow.
  Braked,    ///< It says stop, or nothing.
  Refused,   ///< It moves what the layout has no correction for, or is no number; it was answered by braking.
};
constexpr auto enum_names(CommandOutcome) {
  using enum CommandOutcome;
  return names<CommandOutcome>(
      {{Followed, "followed"}, {Limited, "limited"}, {Braked, "braked"}, {Refused, "refused"}});
}

/// Turns commands into corrections, cycle by cycle. The path is what the controller would do uncorrected: its setpoints
/// where it tells them, else where it stood when the session began. Allocates and throws nothing once it is made.
class PathCorrection {
 public:
  /// @param mode That of the controller's program. @param frame Axes of its Cartesian corrections. @param cycle [s].
  /// @throws InvalidArgument as layout and limits.
  PathCorrection(const TelegramLayout& layout, const CorrectionLimits& limits, robot::CommandMode mode,
                 robot::CommandFrame frame, double cycle);

  /// Whether its first telegram tells the correction that the controller makes already: it measures its setpoints, or
  /// tells none, or corrections of both kinds could be the cause of a difference. Else the next one tells whether the
  /// path stands still.
  bool is_told_by(const ControllerState& first) const noexcept;
  /// A session begins, at rest. Where the setpoints stand still from the first telegram to this one, the correction is
  /// what the controller measures beside them; on a moving path that is the lag of its servos, and there is none.
  void begin(const ControllerState& first, const ControllerState& state) noexcept;
  /// A cycle.
  Correction step(const robot::RobotCommand& command, const ControllerState& state) noexcept;
  /// A cycle without a command: slows down and then stands.
  Correction hold() noexcept;

  CommandOutcome outcome() const noexcept { return outcome_; }
  /// The whole correction of each joint [rad or m].
  robot::JointVector joints() const noexcept;
  /// The whole Cartesian correction: translation, rotation vector [m, rad].
  Vector6 tool() const noexcept;

 private:
  static constexpr std::size_t tool_at = robot::max_joints;  // of its six limiters, behind those of the joints

  bool is_standing(const ControllerState& first, const ControllerState& state) const noexcept;
  void stand_as_measured(const ControllerState& state) noexcept;
  bool step_joints(const robot::RobotCommand& command, const ControllerState& state) noexcept;
  bool step_tool(const robot::RobotCommand& command, const ControllerState& state) noexcept;
  Pose corrected(const Pose& path) const noexcept;
  bool go(std::size_t limiter, double demand, robot::CommandMode mode) noexcept;
  Correction result(const robot::JointVector& joints_before, const Vector6& tool_before) const noexcept;
  bool turn(const Pose& path, const Pose& wanted, robot::CommandMode mode) noexcept;
  void brake(std::size_t first, std::size_t count) noexcept;
  void brake_tool() noexcept;

  TelegramUnits units_;
  robot::CommandMode mode_;
  robot::CommandFrame frame_;
  std::vector<MotionLimiter> limiters_;
  std::optional<RotationLimiter> rotation_;  ///< Instead of those of the rotation, where its total is no limit.
  robot::JointVector start_joints_;
  std::optional<Pose> start_tool_;
  robot::GripperCommand gripper_;
  CommandOutcome outcome_ = CommandOutcome::Braked;
};

}  // namespace kr5::rsi
