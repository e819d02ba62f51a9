// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <vector>

#include <kr5/physics/path_correction.hpp>
#include <kr5/robot/robot.hpp>
#include <kr5/robot/sensing.hpp>
#include <kr5/sim/driven_arm.hpp>
#include <kr5/sim/sensors.hpp>

#include "arm_wander.hpp"
#include "ik_solver.hpp"
#include "joint_lead.hpp"

namespace kr5::sim {

struct CommandedArmOptions {
  double repeatability = 1e-4;  ///< [m]
  double force_delay = 0.0;     ///< [s]
  bool noise = true;
  std::uint64_t seed = 1;
};

/// A wrench on the sensor at an instant.
struct TimedWrench {
  double t = 0.0;                    ///< [s]
  Vector6 wrench = Vector6::Zero();  ///< In S [N, N m].

  static void each_field(auto& self, auto&& visit) {
    visit("t", self.t, "Time [s].");
    visit("wrench", self.wrench, "Wrench in the axes of the sensor [N, N m].");
  }
};

/// An arm in motion: all that its next cycle depends on.
struct CommandedArmState {
  double time = 0.0;  ///< [s]
  DrivenArmState arm;
  WristSensorState sensor;
  std::string encoders, currents, random;
  Vector6 wander = Vector6::Zero();                      ///< [m, rad]
  Eigen::VectorXd q, speed, command;                     ///< [rad or m, and per s]
  std::vector<Eigen::VectorXd> coming;                   ///< [rad or m]
  std::vector<physics::PathCorrectionState> path;        ///< [m or rad]
  Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();  ///< [-]
  Pose T_base_asked = Pose::Identity();                  ///< [m]
  Eigen::VectorXd told_joints;                           ///< [rad or m]
  Pose T_base_told = Pose::Identity();                   ///< [m]
  std::vector<TimedWrench> wrenches;
  Vector6 touch = Vector6::Zero();  ///< [N, N m]
  bool reachable = true;

  static void each_field(auto& self, auto&& visit) {
    visit("time", self.time, "Time [s].");
    visit("arm", self.arm, "Drives and links.");
    visit("sensor", self.sensor, "Force/torque sensor.");
    visit("encoders", self.encoders, "Random numbers of the encoders.");
    visit("currents", self.currents, "Random numbers of the motor currents.");
    visit("random", self.random, "Random numbers of the arm.");
    visit("wander", self.wander, "Error of the tool's pose [m, rad].");
    visit("q", self.q, "Joint setpoints [rad or m].");
    visit("speed", self.speed, "Speed of the setpoints [rad/s or m/s].");
    visit("command", self.command, "What the servos of the joints were told last [rad or m].");
    visit("coming", self.coming, "Setpoints on their way, the next one first [rad or m].");
    visit("path", self.path, "Path correction along X, Y, Z and about them; empty: none under way [m or rad].");
    visit("turned", self.turned, "Orientation of the tool behind the path correction [-].");
    visit("T_base_asked", self.T_base_asked, "Where the tool was last asked to be [m].");
    visit("told_joints", self.told_joints, "Joint values of the last reading [rad or m].");
    visit("T_base_told", self.T_base_told, "Pose of the tool in it [m].");
    visit("wrenches", self.wrenches, "Wrenches that the sensor has not told yet.");
    visit("touch", self.touch, "Wrench on the tool at the sensor, in B [N, N m].");
    visit("reachable", self.reachable, "Whether it could go where it was told.");
  }
};

/// The arm of a cell under robot commands in B: the path correction with its servo and delay, joints with theirs,
/// gears, links, encoders, the wrist sensor.
class CommandedArm {
 public:
  /// Told after each part of a cycle, with its time [s]: what touches the tool moves on.
  using Moved = std::function<void(double passed)>;

  /// @param believed Cell by which its readings are made.
  CommandedArm(const cell::Cell& real, const cell::Cell& believed, const CommandedArmOptions& options);

  /// Stands there at rest.
  void place(const Eigen::VectorXd& joints);
  /// Moves for a cycle.
  void send(const robot::RobotCommand& command, const Moved& moved);
  /// The reading of this cycle; the same until the next one.
  const robot::RobotReading& read(bool gripped);

  /// Wrench of the environment on the tool at the origin of S, in B, from now on [N, N m].
  void touch(const Vector6& wrench);
  const Vector6& touched() const { return touch_; }

  Pose T_base_flange();
  Pose T_base_tool();
  Pose T_base_sensor() { return arm_.arm().T_base_sensor(); }
  double time() const { return time_; }
  double cycle() const { return cycle_; }

  CommandedArmState state() const;
  void restore(const CommandedArmState& state);

 private:
  std::optional<Eigen::VectorXd> asked(const robot::RobotCommand& command);
  Pose served(const Pose& asked);
  void begin_path();
  std::optional<Eigen::VectorXd> posture(const Pose& T_base_tool);
  Eigen::VectorXd delayed(const Eigen::VectorXd& q);
  void follow(const Eigen::VectorXd& before, const Moved& moved);
  Vector6 late_wrench();

  cell::Cell cell_;
  CommandedArmOptions options_;
  Random random_;
  IkSolver ik_;
  DrivenArm arm_;
  WristSensor sensor_;
  Encoders encoders_;
  CurrentSensors currents_;
  robot::SensorModel believed_;
  ArmWander wander_;
  JointLead lead_;
  std::vector<physics::PathCorrection> path_;  ///< Along X, Y, Z, and about them; empty until a path is commanded.
  Eigen::Matrix3d turned_ = Eigen::Matrix3d::Identity();
  std::deque<Eigen::VectorXd> coming_;
  std::deque<TimedWrench> wrenches_;
  robot::RobotReading told_;
  Pose T_base_asked_ = Pose::Identity();
  Eigen::VectorXd command_;
  Vector6 touch_ = Vector6::Zero();
  double cycle_ = 0.0, time_ = 0.0;
  std::size_t delay_cycles_ = 0;
  bool relative_ = false, stopped_ = false, reachable_ = true, read_ = false;
};

}  // namespace kr5::sim
