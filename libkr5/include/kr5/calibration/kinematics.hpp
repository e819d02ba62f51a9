// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <kr5/calibration/estimated_parameter.hpp>
#include <kr5/core/fit_report.hpp>
#include <kr5/fit/pipeline/second_minimum.hpp>
#include <kr5/fit/solution.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/kinematics/dh_chain.hpp>

/// @file
/// Kinematic calibration: the arm's true Denavit-Hartenberg parameters from postures that were measured from outside,
/// or whose tip rested in a fixed socket (Hayat et al. 2022, sections 4.2 and 4.4.1).

namespace kr5::calibration {

/// A posture of the arm with what was measured of it: the pose of the tool, places of points on it, the name of the
/// socket that its first point rested in, or pixels of a fixed target seen by a camera on the flange.
struct ArmPosture {
  std::string name;
  Eigen::VectorXd q;                 ///< [rad or m]
  std::optional<Pose> T_world_tool;  ///< [m]
  Eigen::Matrix3Xd points;           ///< [m]
  std::string socket;
  Eigen::Matrix3Xd target_points;  ///< [m]
  Eigen::Matrix2Xd pixels;         ///< [px]
  Eigen::VectorXd torques;         ///< [N m or N]

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the posture.");
    visit("q", self.q, "Joint values [rad or m].");
    visit("T_world_tool", self.T_world_tool, "Measured pose of the tool in the frame of the measuring device.");
    visit("points", self.points,
          "Measured places of points on the tool in that frame, 3 x n; NaN for one that was not seen [m].");
    visit("socket", self.socket, "Name of the fixed socket in which the first point on the tool rested.");
    visit("target_points", self.target_points, "Points of the fixed target that the camera saw, 3 x n [m].");
    visit("pixels", self.pixels, "Their pixels, 2 x n [px].");
    visit("torques", self.torques, "Torques that hold the arm against gravity, for `elasticity` [N m or N].");
  }
};

/// Known distance of two sockets.
struct SocketDistance {
  std::string first;
  std::string second;
  double distance = 0.0;  ///< [m]
  double sigma = 1e-5;    ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("first", self.first, "Name of a socket.");
    visit("second", self.second, "Name of another socket.");
    visit("distance", self.distance, "Distance of their centres [m].");
    visit("sigma", self.sigma, "Standard deviation of the distance [m].");
  }
};

struct KinematicsOptions {
  double sigma_position = 0.0;    ///< [m]
  double sigma_rotation = 0.0;    ///< [rad]
  double tolerance_length = 0.0;  ///< [m]
  double tolerance_angle = 0.0;   ///< [rad]
  double sigma_pixel = 0.0;       ///< [px]
  double tolerance_tool = 0.0;    ///< [m]
  bool joint_errors = true;
  bool elasticity = false;
  double outlier_false_alarm = 0.01;  ///< [-]
  int max_iterations = 100;
  std::optional<Pose> T_world_base = std::nullopt;
  std::optional<Pose> T_flange_tool = std::nullopt;
  std::optional<Pinhole> camera = std::nullopt;
  std::optional<Pose> T_flange_camera = std::nullopt;
  std::optional<Pose> T_base_target = std::nullopt;
  std::vector<std::string> hold = {};

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("sigma_position", self.sigma_position,
          "Noise of a measured position per axis [m]; 0: estimated from the data.");
    visit("sigma_rotation", self.sigma_rotation,
          "Noise of a measured orientation per axis [rad]; 0: estimated from the data.");
    visit("tolerance_length", self.tolerance_length,
          "Standard deviation of true lengths about the nominal ones [m]; 0: estimated from the data.");
    visit("tolerance_angle", self.tolerance_angle,
          "Standard deviation of true angles about the nominal ones [rad]; 0: estimated from the data.");
    visit("sigma_pixel", self.sigma_pixel, "Noise of a pixel per axis [px]; 0: estimated from the data.");
    visit("tolerance_tool", self.tolerance_tool,
          "Standard deviation of the true position of the tool about a given T_flange_tool, whose orientation is exact "
          "[m]; 0: all of it is exact.");
    visit("joint_errors", self.joint_errors,
          "Estimation of joint errors that change with the joint value: once and twice a turn.");
    visit("elasticity", self.elasticity,
          "Estimation of the compliance of each joint under gravity, for postures with `torques`.");
    visit("outlier_false_alarm", self.outlier_false_alarm,
          "Probability of a false outlier in sound data, over all postures [-].");
    visit("max_iterations", self.max_iterations, "Maximum number of iterations of one fit.");
    visit("T_world_base", self.T_world_base,
          "Known pose of the base in the frame of the measuring device; by default estimated.");
    visit("T_flange_tool", self.T_flange_tool, "Known pose of the measured tool on the flange; by default estimated.");
    visit("camera", self.camera, "Camera on the flange, for postures with pixels.");
    visit("T_flange_camera", self.T_flange_camera, "Approximate pose of the camera on the flange, which is estimated.");
    visit("T_base_target", self.T_base_target, "Approximate pose of its target in the base, which is estimated.");
    visit("hold", self.hold,
          "Coordinates to hold at their nominal value, such as arm.joint2.a, tool.x, or all of base, tool, camera or "
          "target.");
  }
};

/// How one posture agrees with the result.
struct ArmPostureReport {
  std::string name;
  double position_error = 0.0;  ///< [m]
  double rotation_error = 0.0;  ///< [rad]
  double pixel_error = 0.0;     ///< [px]
  double nominal_error = 0.0;   ///< [m]
  double probability = 1.0;     ///< [-]
  bool outlier = false;

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the posture.");
    visit("position_error", self.position_error,
          "RMS distance of its measured from its predicted points; 0 where none was measured [m].");
    visit("rotation_error", self.rotation_error, "Angle between the measured and the predicted orientation [rad].");
    visit("pixel_error", self.pixel_error,
          "RMS distance of its seen from its predicted pixels; 0 where none were seen [px].");
    visit("nominal_error", self.nominal_error,
          "RMS distance with the nominal arm, base and tool as well placed as it allows [m].");
    visit("probability", self.probability, "Probability of a sound posture at this distance from all others [-].");
    visit("outlier", self.outlier, "True for a posture that contradicts the others beyond the noise.");
  }
};

struct KinematicsResult {
  kinematics::DhChain arm;  ///< Identified.
  Pose T_world_base = Pose::Identity();
  Pose T_flange_tool = Pose::Identity();  ///< Where poses were measured.
  Pose T_flange_camera = Pose::Identity();
  Pose T_base_target = Pose::Identity();
  Eigen::Matrix3Xd points;   ///< On the flange [m].
  Eigen::Matrix3Xd sockets;  ///< In the base [m].
  std::vector<std::string> socket_names;
  Eigen::MatrixXd joint_errors;  ///< [rad]
  Eigen::VectorXd compliances;   ///< [rad/(N m) or m/N]
  std::vector<EstimatedParameter> coordinates;
  Eigen::MatrixXd covariance;  ///< In the order of `coordinates`.
  std::vector<fit::UnidentifiableDirection> unidentifiable;
  double sigma_position = 0.0;        ///< [m]
  double sigma_rotation = 0.0;        ///< [rad]
  double sigma_pixel = 0.0;           ///< [px]
  double tolerance_length = 0.0;      ///< [m]
  double tolerance_angle = 0.0;       ///< [rad]
  double tolerance_joint = 0.0;       ///< [rad]
  double tolerance_compliance = 0.0;  ///< [rad/(N m) or m/N]
  double dof = 0.0;                   ///< [-]
  std::vector<ArmPostureReport> postures;
  std::optional<fit::pipeline::SecondMinimum> second;
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("arm", self.arm, "Identified arm.");
    visit("T_world_base", self.T_world_base, "Pose of the base in the frame of the measuring device.");
    visit("T_flange_tool", self.T_flange_tool, "Pose of the measured tool on the flange, where poses were measured.");
    visit("T_flange_camera", self.T_flange_camera, "Pose of the camera on the flange, where pixels were seen.");
    visit("T_base_target", self.T_base_target, "Pose of its target in the base, likewise.");
    visit("points", self.points, "Measured points on the flange, 3 x n [m].");
    visit("sockets", self.sockets, "Centres of the sockets in the base, 3 x n [m].");
    visit("socket_names", self.socket_names, "Their names.");
    visit("joint_errors", self.joint_errors,
          "Errors of the joints that change with the joint value: a row a joint, coefficients of sin q, cos q - 1, sin "
          "2q and cos 2q - 1; empty when not estimated [rad].");
    visit("compliances", self.compliances,
          "Compliance of each joint under gravity; empty when not estimated [rad/(N m) or m/N].");
    visit("coordinates", self.coordinates, "Every estimated number.");
    visit("covariance", self.covariance, "Covariance, in the order and units of `coordinates`.");
    visit("unidentifiable", self.unidentifiable, "Combinations that the measurements alone do not determine.");
    visit("sigma_position", self.sigma_position, "Noise of a measured position per axis, given or estimated [m].");
    visit("sigma_rotation", self.sigma_rotation, "Noise of a measured orientation per axis, given or estimated [rad].");
    visit("sigma_pixel", self.sigma_pixel, "Noise of a pixel per axis, given or estimated [px].");
    visit("tolerance_length", self.tolerance_length, "Spread of true about nominal lengths, given or estimated [m].");
    visit("tolerance_angle", self.tolerance_angle, "Spread of true about nominal angles, given or estimated [rad].");
    visit("tolerance_joint", self.tolerance_joint, "Spread of the coefficients of the joint errors, estimated [rad].");
    visit("tolerance_compliance", self.tolerance_compliance,
          "Spread of the compliances, estimated [rad/(N m) or m/N].");
    visit("dof", self.dof, "Degrees of freedom behind the estimated noise [-].");
    visit("postures", self.postures, "Agreement of each posture, in input order.");
    visit("second", self.second,
          "Another place of the base with nearly the same cost; where the two cannot be told apart, the fit is not "
          "usable.");
    visit("fit", self.fit, "Report of the estimation.");
  }

  /// Joint values at which the identified arm stands when the controller reports q [rad or m] and the joints bear
  /// `torques` [N m or N], which are needed where compliances were estimated.
  Eigen::VectorXd corrected(const Eigen::VectorXd& q, const Eigen::VectorXd& torques = {}) const;
  /// T_base_flange of the identified arm for the same.
  Pose flange(const Eigen::VectorXd& q, const Eigen::VectorXd& torques = {}) const;
};

/// Estimates the parameters of an arm, with base and tool, from postures measured from outside or resting in sockets.
///
/// The true parameters are held to spread about the nominal ones by `tolerance_length` and `tolerance_angle`; these and
/// the noise are estimated by variance components unless given, so that a few postures do not fit their noise. Postures
/// that contradict the others are named and left out. Near-parallel axes get Hayati's angle beta.
/// @throws InvalidArgument for fewer than six postures, postures without a measurement, NaN, or invalid options.
KinematicsResult calibrate_kinematics(const kinematics::DhChain& nominal, std::span<const ArmPosture> postures,
                                      std::span<const SocketDistance> distances = {},
                                      const KinematicsOptions& options = {});

}  // namespace kr5::calibration
