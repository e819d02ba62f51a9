// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/robot/joint_vector.hpp>

/// @file
/// What a robot tells in one cycle: the one input of every controller, whoever stands behind it - a simulated cell, a
/// loopback for tests, a real controller. Of fixed size: copying it allocates nothing and throws nothing.

namespace kr5::robot {

/// What a robot says of itself besides numbers.
struct RobotStatus {
  bool stopped = false;    ///< It stands, because it was told to.
  bool reachable = true;   ///< The arm could go where the last command was.
  bool saturated = false;  ///< The force/torque sensor is at its limit.
  bool gripped = true;     ///< The gripper holds something.

  static void each_field(auto& self, auto&& visit) {
    visit("stopped", self.stopped, "True while the robot stands because it was told to.");
    visit("reachable", self.reachable, "True when the arm could go where the last command was.");
    visit("saturated", self.saturated, "True while the force/torque sensor is at its limit.");
    visit("gripped", self.gripped, "True while the gripper holds something.");
  }
};

/// One instant. What is not measured is empty, or zero. Poses and forces that are not of one instant mislead: with
/// forces 18 ms older than the pose, as with an unmatched filter in a sensor, an insertion fits the hole some 0.3 mm
/// off.
struct RobotReading {
  double time = 0.0;                      ///< From any epoch [s].
  JointVector joints;                     ///< Of the joints, as the encoders say [rad or m].
  JointVector efforts;                    ///< [N m or N]
  JointVector currents;                   ///< Of each motor [A].
  Pose T_base_flange = Pose::Identity();  ///< As the arm believes.
  Pose T_base_tool = Pose::Identity();    ///< The same of the tool tip E.
  Vector6 sensor = Vector6::Zero();       ///< As the force/torque sensor tells it, in its own axes [N, N m].
  Vector6 wrench = Vector6::Zero();  ///< Of the environment on the tool, about the origin of E, axes of B, without the
                                     ///< tool's weight [N, N m].
  double pose_mismatch = 0.0;        ///< Between the tool as the robot tells it and by its joints; 0: one is told [m].
  RobotStatus status;

  static void each_field(auto& self, auto&& visit) {
    visit("time", self.time, "Time of the reading, from any epoch [s].");
    visit("joints", self.joints, "Joint positions by the encoders [rad or m].");
    visit("efforts", self.efforts, "Efforts of the joints; empty: not measured [N m or N].");
    visit("currents", self.currents, "Current of each motor; empty: not measured [A].");
    visit("T_base_flange", self.T_base_flange, "Pose of the flange according to the arm [m].");
    visit("T_base_tool", self.T_base_tool, "Pose of the tool tip E according to the arm [m].");
    visit("sensor", self.sensor, "Reading of the force/torque sensor, in its own axes [N, N m].");
    visit("wrench", self.wrench,
          "Wrench of the environment on the tool about the origin of E, in axes of B, without the tool's weight [N, N "
          "m].");
    visit("pose_mismatch", self.pose_mismatch,
          "Distance of the tool as the robot tells it from where its joints put it; 0: only one of them is told [m].");
    visit("status", self.status, "State of the robot.");
  }
};

}  // namespace kr5::robot
