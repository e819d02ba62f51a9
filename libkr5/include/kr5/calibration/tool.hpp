// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <kr5/core/fit_report.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// Tool centre point from flange poses that all put the tip on one fixed point (Hayat et al. 2022, section 2.2.1:
/// R_k t + p_k = const). Four poses are the controllers' "XYZ 4-point" method; more are least squares.

namespace kr5::calibration {

struct ToolOptions {
  double sigma_position = 0.0;         ///< [m]
  double sigma_rotation = 0.0;         ///< [rad]
  double min_rotation = 0.1;           ///< [rad]
  double outlier_false_alarm = 0.002;  ///< [-]
  bool reject_outliers = true;
  std::optional<double> height_at_calibration;  ///< [m]
  std::optional<double> height_now;             ///< [m]
  std::optional<Eigen::Vector3d> previous;      ///< [m]
  double max_height_change = 0.010;             ///< [m]

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("sigma_position", self.sigma_position,
          "Noise of the touched position per axis, robot and hand [m]; 0 (both sigmas): estimated from the residuals.");
    visit("sigma_rotation", self.sigma_rotation,
          "Noise of the flange orientation per axis [rad]; 0 (both sigmas): estimated from the residuals.");
    visit("min_rotation", self.min_rotation, "Minimum RMS rotation that determines each component of the tip [rad].");
    visit("outlier_false_alarm", self.outlier_false_alarm,
          "Probability of a false outlier in sound data, over all poses [-].");
    visit("reject_outliers", self.reject_outliers,
          "Exclusion of outlier poses from the fit while at least four remain.");
    visit("height_at_calibration", self.height_at_calibration, "Height of the peg when the tip was calibrated [m].");
    visit("height_now", self.height_now, "Height of the peg now [m].");
    visit("previous", self.previous, "Previous tip, in the flange frame [m].");
    visit("max_height_change", self.max_height_change,
          "Change of peg height, or of the tip, above which a warning is given [m].");
  }
};

/// How one pose agrees with the result.
struct ToolPoseReport {
  Eigen::Vector3d residual = Eigen::Vector3d::Zero();  ///< [m]
  double distance = 0.0;                               ///< [m]
  double significance = 1.0;                           ///< [-]
  bool outlier = false;

  static void each_field(auto& self, auto&& visit) {
    visit("residual", self.residual, "Tip according to this pose, minus the fixed point, in the base [m].");
    visit("distance", self.distance, "Length of the residual [m].");
    visit("significance", self.significance,
          "Probability of a sound pose at this distance from the prediction of the others [-].");
    visit("outlier", self.outlier, "True for a pose that contradicts the others beyond the noise.");
  }
};

struct ToolResult {
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();              ///< [m]
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();       ///< [m^2]
  double covariance_dof = 0.0;                                ///< [-]
  Eigen::Vector3d point = Eigen::Vector3d::Zero();            ///< [m]
  double sigma_position = 0.0;                                ///< [m]
  double sigma_rotation = 0.0;                                ///< [rad]
  Eigen::Vector3d rotation_spread = Eigen::Vector3d::Zero();  ///< [rad]
  Eigen::Vector3d weak_direction = Eigen::Vector3d::Zero();   ///< [-]
  std::vector<ToolPoseReport> poses;
  std::vector<std::string> warnings;
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("tip", self.tip, "Tool centre point in the flange frame [m].");
    visit("covariance", self.covariance, covariance_doc("tip", "Covariance of the tip [m^2]."));
    visit("covariance_dof", self.covariance_dof,
          "Degrees of freedom behind the covariance, by which it is already inflated; a million: known noise [-].");
    visit("point", self.point, "Touched point in the base [m].");
    visit("sigma_position", self.sigma_position, "Noise of the touched position per axis, given or estimated [m].");
    visit("sigma_rotation", self.sigma_rotation, "Noise of the orientation per axis, given or estimated [rad].");
    visit("rotation_spread", self.rotation_spread,
          "RMS rotation that determines each principal direction of the tip [rad].");
    visit("weak_direction", self.weak_direction, "Direction in the flange frame along which the tip is least certain.");
    visit("poses", self.poses, "Agreement of each pose, in input order.");
    visit("warnings", self.warnings, "Warnings to consider before the tip is used.");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Estimates the tool centre point from poses of the flange in the base whose tip touches one fixed point.
///
/// The noise model is an isotropic position error and an orientation error that acts at the lever arm of the tip;
/// unless given, both are estimated by restricted maximum likelihood. The covariance is widened for that uncertainty:
/// its normal 95 % region, as from uncertainty::confidence_ellipsoid, holds the truth with 95 %. Poses that all have
/// the same orientation, or turn about one axis only, give FitStatus::Degenerate, with the unknown direction in
/// `weak_direction`.
/// @throws InvalidArgument for fewer than four poses, a pose that is not finite or not proper, or invalid options.
ToolResult calibrate_tool(std::span<const Pose> T_base_flange, const ToolOptions& options = {});

}  // namespace kr5::calibration
