// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <kr5/core/fit_report.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/kinematics/axis_chain.hpp>

/// @file
/// Circle-point analysis: the axis of one joint, from points or poses traced while only that joint moved. No nominal
/// values are needed (Hayat et al. 2022, section 4.2.1).

namespace kr5::calibration {

/// What a measuring device saw at one value of the joint: points that the joint carries, or a pose.
struct JointSample {
  Eigen::Matrix3Xd points;           ///< [m]
  std::optional<Pose> T_world_tool;  ///< [m]
  std::optional<double> q;           ///< [rad]

  static void each_field(auto& self, auto&& visit) {
    visit("points", self.points, "Measured places of points that the joint carries, 3 x n; NaN where not seen [m].");
    visit("T_world_tool", self.T_world_tool, "Measured pose of something that the joint carries.");
    visit("q", self.q, "Joint value, if known; it determines the sense of rotation [rad].");
  }
};

struct JointAxisOptions {
  double sigma_position = 0.0;        ///< [m]
  double sigma_rotation = 0.0;        ///< [rad]
  double min_arc = 0.1;               ///< [rad]
  double outlier_false_alarm = 0.01;  ///< [-]

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("sigma_position", self.sigma_position,
          "Noise of a measured position per axis [m]; 0: estimated from the data.");
    visit("sigma_rotation", self.sigma_rotation,
          "Noise of a measured orientation per axis [rad]; 0: estimated from the data.");
    visit("min_arc", self.min_arc, "Minimum arc that determines an axis [rad].");
    visit("outlier_false_alarm", self.outlier_false_alarm,
          "Probability of a false outlier in sound data, over all samples [-].");
  }
};

/// Residuals of neighbouring samples that are alike: the points leave their circles in a systematic way.
struct SystematicResiduals {
  double correlation = 0.0;  ///< [-]
  double std = 0.0;          ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("correlation", self.correlation, "Of the residuals of samples that follow one another [-].");
    visit("std", self.std, "Its standard deviation where residuals are noise [-].");
  }
};

/// A joint that turned by another angle than its readings say.
struct ScaledReadings {
  double ratio = 1.0;  ///< [-]
  double std = 0.0;    ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("ratio", self.ratio, "Angle by which it turned over that of its readings [-].");
    visit("std", self.std, "Standard deviation of the ratio [-].");
  }
};

/// Reasons to doubt that one joint alone moved.
struct AxisFindings {
  std::optional<SystematicResiduals> systematic_residuals;
  std::optional<ScaledReadings> scaled_readings;

  bool empty() const { return !systematic_residuals && !scaled_readings; }

  static void each_field(auto& self, auto&& visit) {
    visit("systematic_residuals", self.systematic_residuals, "The points leave their circles in a systematic way.");
    visit("scaled_readings", self.scaled_readings, "The joint turned by another angle than its readings say.");
  }
};

struct JointAxisResult {
  kinematics::AxisLine axis;                             ///< Its point is the centre of the first circle.
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();  ///< [m, rad]
  Pose T_world_axis = Pose::Identity();
  double quality = 0.0;         ///< [-]
  double arc = 0.0;             ///< [rad]
  Eigen::VectorXd radii;        ///< [m]
  Eigen::VectorXd angles;       ///< [rad]
  double sigma_position = 0.0;  ///< [m]
  double sigma_rotation = 0.0;  ///< [rad]
  double dof = 0.0;             ///< [-]
  double rms = 0.0;             ///< [m]
  std::vector<int> outliers;
  AxisFindings findings;
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("axis", self.axis, "Axis in the frame of the device; its point is the centre of the first circle.");
    visit("covariance", self.covariance,
          "Covariance of x, y [m] and of the tilts about x and y [rad], in T_world_axis; along and about the axis "
          "nothing is to be known.");
    visit("T_world_axis", self.T_world_axis, "Frame whose z axis is the joint's.");
    visit("quality", self.quality, "Ratio of the first to the third singular value of the points [-].");
    visit("arc", self.arc, "Angle between the first and the last sample [rad].");
    visit("radii", self.radii, "Radius of the circle of each point [m].");
    visit("angles", self.angles, "Estimated joint value of each sample, from the first [rad].");
    visit("sigma_position", self.sigma_position, "Noise of a measured position per axis, given or estimated [m].");
    visit("sigma_rotation", self.sigma_rotation, "Noise of a measured orientation per axis, given or estimated [rad].");
    visit("dof", self.dof, "Degrees of freedom behind the estimated noise [-].");
    visit("rms", self.rms, "RMS distance of the points from their circles [m].");
    visit("outliers", self.outliers, "Samples, counted from 0, that contradict the others and were left out.");
    visit("findings", self.findings, "Reasons to doubt that one joint alone moved.");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Estimates the axis of a joint: plane and circle by singular values as in the source, then the most probable axis,
/// circles and joint values together.
///
/// Its sense is that of growing q, else that in which the samples follow one another. Too short an arc, or a joint that
/// did not move, gives FitStatus::Degenerate with the reason.
/// @throws InvalidArgument for fewer than four samples, a sample without a measurement, poses mixed with points, NaN in
/// a
///         pose, or invalid options.
JointAxisResult identify_joint_axis(std::span<const JointSample> samples, const JointAxisOptions& options = {});

}  // namespace kr5::calibration
