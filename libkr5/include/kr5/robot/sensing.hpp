// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/kinematics/dh_chain.hpp>
#include <kr5/robot/reading.hpp>

/// @file
/// From what sensors tell to a reading: forward kinematics, the tool's weight, the place of the force/torque sensor.
/// Nothing here but `validate` allocates or throws.

namespace kr5::robot {

/// The arm as it is believed, and what hangs on it: all that turns sensors into a reading. The model of a cell is
/// `cell::sensor_model`.
struct SensorModel {
  kinematics::DhChain arm;
  Pose T_flange_tool = Pose::Identity();
  Pose T_flange_sensor = Pose::Identity();
  double mass = 0.0;                              ///< [kg]
  Eigen::Vector3d com = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d gravity = {0.0, 0.0, -9.81};    ///< [m/s^2]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("arm", self.arm, "Chain of joints from the base to the flange.");
    visit("T_flange_tool", self.T_flange_tool, "Tool tip in the flange [m].");
    visit("T_flange_sensor", self.T_flange_sensor, "Force/torque sensor in the flange [m].");
    visit("mass", self.mass, "Mass of everything below the sensor [kg].");
    visit("com", self.com, "Centre of mass of it in S [m].");
    visit("gravity", self.gravity, "Gravity in B [m/s^2].");
  }
};

/// What the sensors of one instant tell.
struct SensorValues {
  double time = 0.0;                 ///< [s]
  JointVector joints;                ///< [rad or m]
  JointVector efforts;               ///< [N m or N]
  JointVector currents;              ///< [A]
  Vector6 sensor = Vector6::Zero();  ///< In S [N, N m].
  RobotStatus status;

  static void each_field(auto& self, auto&& visit) {
    visit("time", self.time, "Time of the values, from any epoch [s].");
    visit("joints", self.joints, "Joint positions by the encoders [rad or m].");
    visit("efforts", self.efforts, "Efforts of the joints; empty: not measured [N m or N].");
    visit("currents", self.currents, "Current of each motor; empty: not measured [A].");
    visit("sensor", self.sensor, "Reading of the force/torque sensor, in its own axes [N, N m].");
    visit("status", self.status, "State of the robot.");
  }
};

/// What a sensor reads of the weight of a body alone, in its own axes S [N, N m].
/// @param mass [kg]. @param com Of the body, in S [m]. @param gravity In B [m/s^2].
Vector6 sensed_weight(double mass, const Eigen::Vector3d& com, const Eigen::Vector3d& gravity,
                      const Eigen::Matrix3d& R_base_sensor) noexcept;
/// What the sensor reads of a wrench on the tool, weight included, in S [N, N m].
/// @param wrench Of the environment, about the origin of E, axes of B [N, N m].
Vector6 sensed_wrench(const SensorModel& model, const Pose& T_base_flange, const Vector6& wrench) noexcept;

/// T_base_flange of joints in place; joints that are not as many as those of the arm give no numbers.
Pose flange_pose(const kinematics::DhChain& arm, const JointVector& joints) noexcept;

/// The reading of an instant. Joints that are not as many as those of the arm give poses that are no numbers, for which
/// a controller stops.
RobotReading robot_reading(const SensorModel& model, const SensorValues& values) noexcept;
/// The same for a robot that tells the pose of its flange itself.
RobotReading robot_reading(const SensorModel& model, const SensorValues& values, const Pose& T_base_flange) noexcept;

}  // namespace kr5::robot
