// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <kr5/core/fit_report.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/geometry/view.hpp>

/// @file
/// Hand-eye calibration: where the camera sits on the flange (or in the base), from views of one target.

namespace kr5::calibration {

/// What carries the camera.
enum class Mount {
  EyeInHand,  ///< Camera on the flange, target fixed in the base.
  EyeToHand,  ///< Camera fixed in the base, target on the flange.
};

constexpr auto enum_names(Mount) {
  return names<Mount>({{Mount::EyeInHand, "eye_in_hand"}, {Mount::EyeToHand, "eye_to_hand"}});
}

/// One robot stop at which the target was seen.
struct HandEyeView {
  Pose T_base_flange = Pose::Identity();  ///< From the robot controller.
  View view;                              ///< Target points and their pixels.
  double correlation = 1.0;               ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("T_base_flange", self.T_base_flange, "From the robot controller.");
    visit("view", self.view, "Target points and their pixels.");
    visit("correlation", self.correlation,
          "Variance of the most doubtful change of all points together over that of independent ones, at least 1, as a "
          "detection says it: corners of one tag err together. The pixels count so much less [-].");
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
    visit("mount", self.mount, "eye_in_hand: camera on the flange; eye_to_hand: camera fixed in the base.");
    visit("sigma_pixel", self.sigma_pixel, "Noise of a detected point per axis [px]; 0: estimated from the data.");
    visit("sigma_robot_position", self.sigma_robot_position,
          "Noise of a robot position per axis [m]; 0: estimated from the data.");
    visit("sigma_robot_rotation", self.sigma_robot_rotation,
          "Noise of a robot orientation per axis [rad]; 0: estimated from the data.");
    visit("min_rotation", self.min_rotation, "Least turn of the wrist, about two axes, to attempt an answer [rad].");
    visit("outlier_false_alarm", self.outlier_false_alarm,
          "Chance that views without an outlier get one named, all views together [-].");
    visit("max_iterations", self.max_iterations, "At most so many steps of the refinement.");
    visit("start", self.start, "First guess of T_mount_camera; by default from a closed form.");
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
    visit("rms_px", self.rms_px, "RMS distance of seen and predicted points, with the robot pose as reported [px].");
    visit("robot_position", self.robot_position, "Shift of the robot position that would explain the view [m].");
    visit("robot_rotation", self.robot_rotation, "Turn of the robot that would explain the view [rad].");
    visit("weight", self.weight, "Weight of the view in the fit, 1 for a sound one [-].");
    visit("outlier", self.outlier, "Contradicts the others beyond the noise.");
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
  std::vector<HandEyeViewReport> views;         ///< In input order.
  FitReport fit;                                ///< Look at `fit.usable()` before the poses.

  static void each_field(auto& self, auto&& visit) {
    visit("mount", self.mount, "What carries the camera.");
    visit("T_mount_camera", self.T_mount_camera,
          "Pose of the camera on the flange (in hand) or in the base (to hand).");
    visit("T_fixed_target", self.T_fixed_target,
          "Pose of the target in the base (in hand) or on the flange (to hand).");
    visit("covariance", self.covariance, "Of T_mount_camera, right perturbation [m, rad].");
    visit("covariance_target", self.covariance_target, "Of T_fixed_target, right perturbation [m, rad].");
    visit("covariance_dof", self.covariance_dof,
          "Degrees of freedom behind the covariance, for which it is widened already; a million: noise given [-].");
    visit("sigma_pixel", self.sigma_pixel, "Noise of a detected point, given or estimated [px].");
    visit("sigma_robot_position", self.sigma_robot_position, "Noise of a robot position, given or estimated [m].");
    visit("sigma_robot_rotation", self.sigma_robot_rotation, "Noise of a robot orientation, given or estimated [rad].");
    visit("views", self.views, "How each view agrees, in input order.");
    visit("fit", self.fit, "How the estimation ended.");
  }
};

/// Estimates camera and target pose together from pixels and robot poses, both with their noise.
///
/// The true robot pose of a view is the reported one times to_pose(e), e normal; each view's e is eliminated, which
/// leaves twelve unknowns. Noise levels that are not given are estimated by restricted maximum likelihood, the ratio of
/// robot position and rotation noise being held loosely near the arm's reach (else three views could not part them).
/// The covariances are widened for that doubt (Kenward and Roger 1997): their normal 95 % regions, as from
/// uncertainty::confidence_ellipsoid, hold the truth with 95 %. Views that contradict the others get weight 0 and are
/// named, at a false-alarm rate per set of `outlier_false_alarm`; at least six in ten views stay in the fit.
///
/// The diagnosis (hand_eye_diagnosis.hpp) has a quicker fitter of its own, which sees each view as one pose: it
/// compares a hundred ways of reading the same data. What it finds says which reading is right; the answer itself comes
/// from here.
///
/// Data that cannot determine the answer give `fit.status == FitStatus::Degenerate` and say why in `fit.message`.
/// @throws InvalidArgument for fewer than three views, a view with fewer than four points, NaN, or invalid options.
HandEyeResult calibrate_hand_eye(std::span<const HandEyeView> views, const Pinhole& camera,
                                 const HandEyeOptions& options = {});

}  // namespace kr5::calibration
