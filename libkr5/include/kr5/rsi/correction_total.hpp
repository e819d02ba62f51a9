// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/rsi/controller_state.hpp>
#include <kr5/rsi/emulation_events.hpp>

namespace kr5::rsi {

/// The total correction of a controller's path, from what it receives cycle by cycle: all of it (absolute) or what is
/// added (relative), within the controller's limits. Once made, it allocates nothing and throws nothing.
class CorrectionTotal {
 public:
  /// @param mode That of the controller's program. @param frame Axes of its Cartesian corrections.
  /// @throws InvalidArgument as ControllerRules::validate.
  CorrectionTotal(const ControllerRules& rules, robot::CommandMode mode, robot::CommandFrame frame, int joints);

  /// A cycle; why the program stops with it, if it does: then the correction stays as it was.
  /// @param share Of what is received that counts [-].
  ProgramStop take(const Correction& received, double share = 1.0) noexcept;
  void clear() noexcept;

  /// Of each joint [rad or m].
  const robot::JointVector& joints() const noexcept { return joints_; }
  const Pose& tool() const noexcept { return tool_; }
  /// The path with the correction of the tool.
  Pose corrected(const Pose& path) const noexcept;
  /// The last correction was held at a limit.
  bool limited() const noexcept { return limited_; }

 private:
  double limit_of(Eigen::Index joint) const noexcept;
  ProgramStop limit_joints(robot::JointVector& wanted) noexcept;
  ProgramStop limit_tool(Pose& wanted) noexcept;

  ControllerRules rules_;
  robot::CommandMode mode_;
  robot::CommandFrame frame_;
  robot::JointVector joints_;
  Pose tool_ = Pose::Identity();
  bool limited_ = false;
};

}  // namespace kr5::rsi
