// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/cell/cell.hpp>
#include <kr5/core/fields.hpp>
#include <kr5/core/fit_report.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/kinematics/dh_chain.hpp>

/// @file
/// Force/torque sensor and the tool below it from postures, or from a motion whose accelerations are known: bias,
/// drift, mass and centre of the tool, orientation of the sensor, gain and crosstalk.

namespace kr5::identification {

/// One reading of the sensor with the motion in which it was taken.
struct ForceTorqueReading {
  Vector6 wrench = Vector6::Zero();
  Eigen::Vector3d gravity = {0.0, 0.0, -9.81};
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_acceleration = Eigen::Vector3d::Zero();
  double t = 0.0;
  double load_mass = 0.0;
  Eigen::Vector3d load_com = Eigen::Vector3d::Zero();

  static void each_field(auto& self, auto&& visit) {
    visit("wrench", self.wrench, "Reading, force first, in S [N, N m].");
    visit("gravity", self.gravity, "Gravity less the acceleration of the sensor, in the axes of the flange [m/s^2].");
    visit("angular_velocity", self.angular_velocity, "Angular velocity in the axes of the flange [rad/s].");
    visit("angular_acceleration", self.angular_acceleration,
          "Angular acceleration in the axes of the flange [rad/s^2].");
    visit("t", self.t, "Time, for the drift [s].");
    visit("load_mass", self.load_mass, "Mass of a known load beside the tool [kg].");
    visit("load_com", self.load_com, "Centre of mass of that load, in S [m].");
  }
};

/// Entries of the gain that are estimated.
enum class GainModel {
  None,       ///< The gain is 1.
  Diagonal,   ///< One factor a component.
  Crosstalk,  ///< All 36.
};
constexpr auto enum_names(GainModel) {
  return names<GainModel>(
      {{GainModel::None, "none"}, {GainModel::Diagonal, "diagonal"}, {GainModel::Crosstalk, "crosstalk"}});
}

struct ForceTorqueOptions {
  GainModel gain = GainModel::None;
  bool fit_drift = false;
  bool fit_orientation = false;
  Pose T_flange_sensor = Pose::Identity();
  Vector6 inertia = Vector6::Zero();
  double force_noise = 0.15;
  double torque_noise = 0.008;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("gain", self.gain, "Gain to estimate: none | diagonal | crosstalk; it takes known loads.");
    visit("fit_drift", self.fit_drift, "Estimate a drift of each component over time.");
    visit("fit_orientation", self.fit_orientation, "Estimate the orientation of the sensor on the flange.");
    visit("T_flange_sensor", self.T_flange_sensor, "Nominal pose of the sensor in the flange [m, rad].");
    visit("inertia", self.inertia,
          "Known inertia Ixx Iyy Izz Ixy Ixz Iyz of the tool about its centre of mass, axes of S [kg m^2].");
    visit("force_noise", self.force_noise, "Standard deviation of a force to begin with [N].");
    visit("torque_noise", self.torque_noise, "Standard deviation of a torque to begin with [N m].");
  }
};

/// One number of the sensor or the tool.
struct SensorParameter {
  std::string name;
  std::string unit;
  double value = 0.0;
  double std = 0.0;
  bool told = true;

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name, such as bias.fx.");
    visit("unit", self.unit, "Unit.");
    visit("value", self.value, "Estimate, in the unit.");
    visit("std", self.std, "Standard deviation, in the unit.");
    visit("told", self.told, "Whether the readings distinguish it from the others.");
  }
};

struct ForceTorqueResult {
  Vector6 bias = Vector6::Zero();
  Vector6 rate = Vector6::Zero();
  Matrix6 gain = Matrix6::Identity();
  double mass = 0.0;
  Eigen::Vector3d com = Eigen::Vector3d::Zero();
  Pose T_flange_sensor = Pose::Identity();
  std::vector<SensorParameter> parameters;
  Eigen::MatrixXd covariance;
  double force_noise = 0.0;
  double torque_noise = 0.0;
  std::vector<int> outliers;
  Eigen::MatrixXd predicted;
  std::vector<std::string> warnings;
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("bias", self.bias, "Offset of each component [N, N m].");
    visit("rate", self.rate, "Rate at which each offset grows [N/s, N m/s].");
    visit("gain", self.gain, "Gain and crosstalk: reading = gain * wrench + bias + t * rate [-, 1/m, m].");
    visit("mass", self.mass, "Mass of all that hangs below the sensor, known loads apart [kg].");
    visit("com", self.com, "Its centre of mass in S [m].");
    visit("T_flange_sensor", self.T_flange_sensor, "Sensor in the flange [m, rad].");
    visit("parameters", self.parameters, "Every estimated number by name.");
    visit("covariance", self.covariance, covariance_doc("parameters", "Covariance of `parameters`."));
    visit("force_noise", self.force_noise, "Standard deviation of the force residuals [N].");
    visit("torque_noise", self.torque_noise, "Standard deviation of the torque residuals [N m].");
    visit("outliers", self.outliers, "Readings that contradict the others and are left out, counted from 0.");
    visit("predicted", self.predicted, "Fitted reading, N x 6 [N, N m].");
    visit("warnings", self.warnings, "Evidence against the model.");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Least squares over all readings, by the law of `physics::WrenchSensor`. `fit.usable()` is false when the readings do
/// not tell every parameter that is asked for; the message names those.
/// @throws InvalidArgument for invalid readings or options.
ForceTorqueResult identify_force_torque(std::span<const ForceTorqueReading> readings,
                                        const ForceTorqueOptions& options = {});

/// Readings of postures that rest: q and wrench a row each, times as well or empty.
/// @throws InvalidArgument when the numbers of rows or joints differ.
std::vector<ForceTorqueReading> posture_readings(const cell::Cell& cell, const kinematics::Rows& q,
                                                 const kinematics::Rows& wrench, const Eigen::VectorXd& t = {});

/// Readings of a motion, with the accelerations that the joint servos of the cell make of the commands, a row a sample.
/// @throws InvalidArgument when the cell has no joint servo or tool, or sizes differ.
std::vector<ForceTorqueReading> motion_readings(const cell::Cell& cell, const Eigen::VectorXd& t,
                                                const kinematics::Rows& command, const kinematics::Rows& wrench);

}  // namespace kr5::identification
