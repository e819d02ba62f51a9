// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/force/force_loop.hpp>
#include <kr5/robot/command.hpp>
#include <kr5/robot/reading.hpp>

namespace kr5::force {

struct AxisForceOptions {
  ForceLoopOptions loop = {};
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< [-]
  robot::CommandFrame frame = robot::CommandFrame::Tool;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("loop", self.loop, "Options of the force loop.");
    visit("axis", self.axis, "Direction into the contact, of any length [-].");
    visit("frame", self.frame, "Axes of that direction when the loop begins: base | tool.");
  }
};

/// The force loop on a robot: holds a force along one axis, from readings to commands. Nothing here allocates or throws
/// once it is made.
class AxisForceControl {
 public:
  /// @throws InvalidArgument as its options.
  explicit AxisForceControl(const AxisForceOptions& options);

  /// The correction of this cycle: of the pose of the first reading since reset(), or, with
  /// `CorrectionReference::Actual`, a motion from where the tool is. A reading that is no finite number moves nothing.
  /// @param reference Force of the tool into the contact [N].
  robot::RobotCommand step(const robot::RobotReading& reading, double reference) noexcept;
  /// Force of the tool into the contact, by a reading [N]; 0 before the first step.
  double measured(const robot::RobotReading& reading) const noexcept;
  const ForceLoop& loop() const noexcept { return loop_; }
  /// Begins anew, where the tool is at the next reading.
  void reset() noexcept;

 private:
  AxisForceOptions options_;
  ForceLoop loop_;
  bool begun_ = false;
  Pose T_base_start_ = Pose::Identity();
  Eigen::Vector3d axis_ = Eigen::Vector3d::Zero();  ///< In B, of length 1.
};

}  // namespace kr5::force
