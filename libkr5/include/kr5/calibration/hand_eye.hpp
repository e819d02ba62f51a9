// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <kr5/core/fit_report.hpp>
#include <kr5/fit/pipeline/second_minimum.hpp>
#include <kr5/geometry/mount.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/geometry/view.hpp>

/// @file
/// Hand-eye calibration: pose of the camera on the flange (or in the base), from views of one target.

namespace kr5::calibration {

/// One robot stop at which the target was seen.
struct HandEyeView {
  Pose T_base_flange = Pose::Identity();  ///< From the robot controller.
  View view;                              ///< Target points and their pixels.
  double correlation = 1.0;               ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("T_base_flange", self.T_base_flange, "Pose of the flange in the base, from the robot controller.");
    visit("view", self.view, "Target points and their pixels.");
    visit("correlation", self.correlation,
          "Correlation factor: variance of the least certain common change of all points over that of independent "
          "points, at least 1, as given by the detection; the weight of the pixels is divided by it [-].");
  }
};

struct HandEyeOptions {
  Mount mount = Mount::EyeInHand;
  double sigma_pixel = 0.0;           ///< [px]
  double sigma_robot_position = 0.0;  ///< [m]
  double sigma_robot_rotation = 0.0;  ///< [rad]
  double min_rotation = 0.1;          ///< [rad]
  double outlier_false_alarm = 0.01;  ///< [-]
  int max_iterations = 100;
  std::optional<Pose> start = std::nullopt;  ///< T_mount_camera

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("mount", self.mount, "Mount of the camera: eye_in_hand (on the flange) | eye_to_hand (fixed in the base).");
    visit("sigma_pixel", self.sigma_pixel, "Noise of a detected point per axis [px]; 0: estimated from the data.");
    visit("sigma_robot_position", self.sigma_robot_position,
          "Noise of a robot position per axis [m]; 0: estimated from the data.");
    visit("sigma_robot_rotation", self.sigma_robot_rotation,
          "Noise of a robot orientation per axis [rad]; 0: estimated from the data.");
    visit("min_rotation", self.min_rotation, "Minimum rotation of the wrist, about two axes, for a calibration [rad].");
    visit("outlier_false_alarm", self.outlier_false_alarm,
          "Probability of a false outlier in sound data, over all views [-].");
    visit("max_iterations", self.max_iterations, "Maximum number of iterations of the refinement.");
    visit("start", self.start, "Initial value of T_mount_camera; by default from a closed form.");
  }
};

/// How one view agrees with the result.
struct HandEyeViewReport {
  std::string name;
  double rms_px = 0.0;          ///< [px]
  double robot_position = 0.0;  ///< [m]
  double robot_rotation = 0.0;  ///< [rad]
  double weight = 1.0;          ///< [-]
  bool outlier = false;

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the view.");
    visit("rms_px", self.rms_px,
          "RMS distance of observed and predicted points, with the robot pose as reported [px].");
    visit("robot_position", self.robot_position, "Position error of the robot that would explain the view [m].");
    visit("robot_rotation", self.robot_rotation, "Rotation error of the robot that would explain the view [rad].");
    visit("weight", self.weight, "Weight of the view in the fit, 1 for a normal one [-].");
    visit("outlier", self.outlier, "True for a view that contradicts the others beyond the noise.");
  }
};

struct HandEyeResult {
  Mount mount = Mount::EyeInHand;
  Pose T_mount_camera = Pose::Identity();       ///< T_flange_camera (in hand) or T_base_camera (to hand).
  Pose T_fixed_target = Pose::Identity();       ///< T_base_target (in hand) or T_flange_target (to hand).
  Matrix6 covariance = Matrix6::Zero();         ///< Of T_mount_camera, right perturbation [m, rad].
  Matrix6 covariance_target = Matrix6::Zero();  ///< Of T_fixed_target, right perturbation [m, rad].
  double covariance_dof = 0.0;                  ///< [-]
  double sigma_pixel = 0.0;                     ///< [px]
  double sigma_robot_position = 0.0;            ///< [m]
  double sigma_robot_rotation = 0.0;            ///< [rad]
  double sigma_camera_rotation = 0.0;           ///< [rad]
  std::vector<HandEyeViewReport> views;         ///< In input order.
  std::optional<fit::pipeline::SecondMinimum> second;
  FitReport fit;  ///< Look at `fit.usable()` before the poses.

  static void each_field(auto& self, auto&& visit) {
    visit("mount", self.mount, "Mount of the camera.");
    visit("T_mount_camera", self.T_mount_camera,
          "Pose of the camera on the flange (in hand) or in the base (to hand).");
    visit("T_fixed_target", self.T_fixed_target,
          "Pose of the target in the base (in hand) or on the flange (to hand).");
    visit("covariance", self.covariance,
          covariance_doc("T_mount_camera", "Covariance of T_mount_camera, right perturbation [m, rad]."));
    visit("covariance_target", self.covariance_target,
          covariance_doc("T_fixed_target", "Covariance of T_fixed_target, right perturbation [m, rad]."));
    visit("covariance_dof", self.covariance_dof,
          "Degrees of freedom behind the covariance, by which it is already inflated; a million: known noise [-].");
    visit("sigma_pixel", self.sigma_pixel, "Noise of a detected point, given or estimated [px].");
    visit("sigma_robot_position", self.sigma_robot_position, "Noise of a robot position, given or estimated [m].");
    visit("sigma_robot_rotation", self.sigma_robot_rotation, "Noise of a robot orientation, given or estimated [rad].");
    visit("sigma_camera_rotation", self.sigma_camera_rotation,
          "Noise of a seen orientation of the target, given or estimated from pairs of poses; 0 from pixels [rad].");
    visit("views", self.views, "Agreement of each view, in input order.");
    visit("second", self.second,
          "Another pose of the camera with nearly the same cost; where the two cannot be told apart, the fit is not "
          "usable.");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Estimates camera and target pose together from pixels and robot poses, both with their noise.
///
/// The true robot pose of a view is the reported one times to_pose(e), e normal; the pose of the target
/// in each view is eliminated, which leaves twelve unknowns. Noise levels that are not given are estimated by
/// restricted maximum likelihood, the ratio of robot position and rotation noise being held loosely near the arm's
/// reach (else three views could not part them). The covariances are widened for that uncertainty (Kenward and Roger
/// 1997): their normal 95 % regions, as from uncertainty::confidence_ellipsoid, hold the truth with 95 %. Views that
/// contradict the others get weight 0 and are named, at a false-alarm rate per set of `outlier_false_alarm`; at least
/// six in ten views stay in the fit.
///
/// The diagnosis (hand_eye_diagnosis.hpp) has a quicker fitter of its own, which sees each view as one pose: it
/// compares a hundred ways of reading the same data. Its result shows which reading is right; the answer itself comes
/// from here.
///
/// Data that cannot determine the answer give `fit.status == FitStatus::Degenerate` and the reason in `fit.message`.
/// @throws InvalidArgument for fewer than three views, a view with fewer than four points, NaN, or invalid options.
HandEyeResult calibrate_hand_eye(std::span<const HandEyeView> views, const Pinhole& camera,
                                 const HandEyeOptions& options = {});

}  // namespace kr5::calibration
