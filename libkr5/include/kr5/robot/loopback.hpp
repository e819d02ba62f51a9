// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <utility>

#include <kr5/core/random.hpp>
#include <kr5/robot/cycle.hpp>
#include <kr5/robot/robot.hpp>
#include <kr5/robot/sensing.hpp>

namespace kr5::robot {

struct LoopbackOptions {
  double cycle = usual_cycle;      ///< [s]
  double delay = 2 * usual_cycle;  ///< [s]
  CommandLimits limits = {};
  double joint_noise = 0.0;     ///< [rad or m]
  double position_noise = 0.0;  ///< [m]
  double rotation_noise = 0.0;  ///< [rad]
  double force_noise = 0.0;     ///< [N]
  double torque_noise = 0.0;    ///< [N m]
  std::uint64_t seed = 1;

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("cycle", self.cycle, "Time between two readings [s].");
    visit("delay", self.delay, "Time from a command to the reading that shows it, in whole cycles, at least one [s].");
    visit("limits", self.limits, "Greatest motion of the robot in one cycle, whatever a command allows.");
    visit("joint_noise", self.joint_noise, "Noise of the joint readings of an arm, standard deviation [rad or m].");
    visit("position_noise", self.position_noise,
          "Noise of the tool's position in the readings of a robot without joints, per axis [m].");
    visit("rotation_noise", self.rotation_noise, "The same of its orientation, per axis [rad].");
    visit("force_noise", self.force_noise, "Noise of the sensor's forces [N].");
    visit("torque_noise", self.torque_noise, "Noise of the sensor's torques [N m].");
    visit("seed", self.seed, "Random seed of the noise.");
  }
};

/// A robot that does what it is told, after its delay and within its limits: the edge at which a controller is tested
/// without a cell. With an arm it moves joints, and takes commands of the tool by inverse kinematics; without, its tool
/// flies.
class LoopbackRobot : public Robot {
 public:
  /// Wrench of the environment on the tool, about the origin of E, axes of B, when the tool is at a pose [N, N m].
  using Environment = std::function<Vector6(const Pose& T_base_tool)>;

  /// @param model Of the arm and its sensor; without joints the tool flies.
  /// @throws InvalidArgument as options and model.
  explicit LoopbackRobot(const LoopbackOptions& options = {}, const SensorModel& model = {});

  /// Stands there, with no command on its way.
  /// @throws InvalidArgument for joints that are not as many as those of the arm, or a pose that the arm does not
  /// reach.
  void place(const JointVector& joints);
  void place(const Pose& T_base_tool);
  void set_environment(Environment environment) { environment_ = std::move(environment); }
  /// What is told of sensor and gripper from now on; the rest of the status is the robot's own.
  void set_status(bool saturated, bool gripped) noexcept;

  RobotReading read() override;
  void send(const RobotCommand& command) override;
  double cycle() const override { return options_.cycle; }

  /// Where the tool is, without noise.
  const Pose& T_base_tool() const noexcept { return T_base_tool_; }
  const JointVector& joints() const noexcept { return joints_; }
  /// What the gripper does.
  const GripperCommand& gripper() const noexcept { return gripper_; }

 private:
  bool has_arm() const noexcept { return !model_.arm.joints.empty(); }
  /// Nearest joint values that bring the tool to a pose; false when there are none.
  bool reach(const Pose& T_base_tool);
  void obey(RobotCommand command);

  LoopbackOptions options_;
  SensorModel model_;
  Random random_;
  Environment environment_;
  std::deque<RobotCommand> coming_;
  std::size_t delay_cycles_ = 1;
  double time_ = 0.0;
  JointVector joints_;
  Pose T_base_tool_ = Pose::Identity();
  RobotStatus status_;
  GripperCommand gripper_;
};

}  // namespace kr5::robot
