// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include <kr5/calibration/estimated_parameter.hpp>
#include <kr5/calibration/hand_eye.hpp>
#include <kr5/calibration/scanner.hpp>
#include <kr5/fit/solution.hpp>
#include <kr5/geometry/target.hpp>

/// @file
/// Calibration of a whole cell in one solve: camera, hand-eye, marker map and arm from the same images and postures.

namespace kr5::calibration {

/// One robot stop at which the target was seen.
struct CellStop {
  HandEyeView view;
  Eigen::VectorXd q;  ///< [rad or m]

  static void each_field(auto& self, auto&& visit) {
    visit("view", self.view, "Robot pose and pixels; with joint values the pose is not looked at.");
    visit("q", self.q, "Joint values, where the arm is also to be calibrated [rad or m].");
  }
};

/// What the calibration begins with and what it refines.
struct CellGeometry {
  Pinhole camera;
  std::vector<MapMarker> markers;  ///< Empty: the points of the target are exact.
  kinematics::DhChain arm;         ///< Without joints: robot poses as they are reported.

  static void each_field(auto& self, auto&& visit) {
    visit("camera", self.camera, "Camera.");
    visit("markers", self.markers, "Markers of the target, when their places are to be estimated; else empty.");
    visit("arm", self.arm, "Arm, when it is to be calibrated; else without joints.");
  }
};

/// What a line scanner on the flange saw.
struct CellScan {
  std::vector<ScannerView> views;  ///< Without any there is no scanner.
  std::vector<ScanTarget> targets;
  ScannerOptions options;

  static void each_field(auto& self, auto&& visit) {
    visit("views", self.views, "Profiles, each with the flange or joint values; without any there is no scanner.");
    visit("targets", self.targets, "Targets that the profiles show.");
    visit("options", self.options, "Options of calibrate_scanner, which finds start, noise and outliers.");
  }
};

struct CellCalibrationOptions {
  Mount mount = Mount::EyeInHand;
  std::vector<std::string> hold = {};
  double sigma_pixel = 0.0;           ///< [px]
  double sigma_robot_position = 0.0;  ///< [m]
  double sigma_robot_rotation = 0.0;  ///< [rad]
  double tolerance_length = 0.0;      ///< [m]
  double tolerance_angle = 0.0;       ///< [rad]
  double min_rotation = 0.1;          ///< [rad]
  double outlier_false_alarm = 0.01;  ///< [-]
  int max_iterations = 100;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("mount", self.mount, "Mount of the camera: eye_in_hand (on the flange) | eye_to_hand (fixed in the base).");
    visit("hold", self.hold,
          "Parameters to hold at their start: camera, markers or arm as a whole, or one such as camera.k1 or "
          "arm.joint2.a.");
    visit("sigma_pixel", self.sigma_pixel, "Noise of a detected point per axis [px]; 0: estimated from the data.");
    visit("sigma_robot_position", self.sigma_robot_position,
          "Noise of a robot position per axis [m]; 0: estimated from the data.");
    visit("sigma_robot_rotation", self.sigma_robot_rotation,
          "Noise of a robot orientation per axis [rad]; 0: estimated from the data.");
    visit("tolerance_length", self.tolerance_length,
          "Spread of true about nominal lengths of the arm [m]; 0: estimated from the data.");
    visit("tolerance_angle", self.tolerance_angle,
          "Spread of true about nominal angles of the arm [rad]; 0: estimated from the data.");
    visit("min_rotation", self.min_rotation, "Minimum rotation of the wrist, about two axes, for a calibration [rad].");
    visit("outlier_false_alarm", self.outlier_false_alarm,
          "Probability of a false outlier in sound data, over all views [-].");
    visit("max_iterations", self.max_iterations, "Maximum number of iterations of one fit.");
  }
};

struct CellCalibrationResult {
  Mount mount = Mount::EyeInHand;
  CellGeometry cell;
  Pose T_mount_camera = Pose::Identity();       ///< T_flange_camera (in hand) or T_base_camera (to hand).
  Pose T_fixed_target = Pose::Identity();       ///< T_base_target (in hand) or T_flange_target (to hand).
  Matrix6 covariance = Matrix6::Zero();         ///< Of T_mount_camera, right perturbation [m, rad].
  Matrix6 covariance_target = Matrix6::Zero();  ///< Of T_fixed_target, right perturbation [m, rad].
  Pose T_flange_scanner = Pose::Identity();
  Matrix6 covariance_scanner = Matrix6::Zero();  ///< [m, rad]
  Pose T_camera_scanner = Pose::Identity();
  Matrix6 covariance_camera_scanner = Matrix6::Zero();  ///< [m, rad]
  std::vector<EstimatedParameter> parameters;           ///< Poses by their change from the start.
  Eigen::MatrixXd parameter_covariance;                 ///< In the order and units of `parameters`.
  std::vector<fit::UnidentifiableDirection> unidentifiable;
  double sigma_pixel = 0.0;           ///< [px]
  double sigma_robot_position = 0.0;  ///< [m]
  double sigma_robot_rotation = 0.0;  ///< [rad]
  double tolerance_length = 0.0;      ///< [m]
  double tolerance_angle = 0.0;       ///< [rad]
  double covariance_dof = 0.0;        ///< [-]
  std::optional<fit::pipeline::SecondMinimum> second;
  HandEyeResult start;                   ///< Camera, markers and arm as they were given.
  ScannerResult scanner_start;           ///< Scanner alone, where there is one.
  std::vector<HandEyeViewReport> views;  ///< In input order.
  FitReport fit;                         ///< Look at `fit.usable()` first.

  static void each_field(auto& self, auto&& visit) {
    visit("mount", self.mount, "Mount of the camera.");
    visit("cell", self.cell, "Calibrated camera, markers and arm.");
    visit("T_mount_camera", self.T_mount_camera,
          "Pose of the camera on the flange (in hand) or in the base (to hand).");
    visit("T_fixed_target", self.T_fixed_target,
          "Pose of the target in the base (in hand) or on the flange (to hand).");
    visit("covariance", self.covariance,
          covariance_doc(
              "T_mount_camera",
              "Covariance of T_mount_camera, right perturbation, the uncertainty of all else included [m, rad]."));
    visit("covariance_target", self.covariance_target,
          covariance_doc("T_fixed_target", "Covariance of T_fixed_target, right perturbation [m, rad]."));
    visit("T_flange_scanner", self.T_flange_scanner, "Scanner in the flange, where there is one.");
    visit("covariance_scanner", self.covariance_scanner,
          covariance_doc("T_flange_scanner", "Covariance of T_flange_scanner, right perturbation [m, rad]."));
    visit("T_camera_scanner", self.T_camera_scanner, "Scanner in a camera that is also on the flange.");
    visit("covariance_camera_scanner", self.covariance_camera_scanner,
          covariance_doc("T_camera_scanner",
                         "Covariance of T_camera_scanner, right perturbation, with what camera and scanner have in "
                         "common [m, rad]."));
    visit("parameters", self.parameters, "Every estimated number; of a pose the change from the start.");
    visit("parameter_covariance", self.parameter_covariance, "Covariance, in the order and units of `parameters`.");
    visit("unidentifiable", self.unidentifiable, "Combinations that the measurements alone do not determine.");
    visit("sigma_pixel", self.sigma_pixel, "Noise of a detected point, given or estimated [px].");
    visit("sigma_robot_position", self.sigma_robot_position, "Noise of a robot position, given or estimated [m].");
    visit("sigma_robot_rotation", self.sigma_robot_rotation, "Noise of a robot orientation, given or estimated [rad].");
    visit("tolerance_length", self.tolerance_length, "Spread of true about nominal lengths, given or estimated [m].");
    visit("tolerance_angle", self.tolerance_angle, "Spread of true about nominal angles, given or estimated [rad].");
    visit("covariance_dof", self.covariance_dof,
          "Degrees of freedom behind the robot noise, by which the covariances are already inflated [-].");
    visit("second", self.second,
          "Another pose of the camera that explains the stops nearly as well; without a value: there is none near.");
    visit("start", self.start, "Hand-eye calibration with camera, markers and arm as they were given.");
    visit("scanner_start", self.scanner_start, "Calibration of the scanner alone, where there is one.");
    visit("views", self.views, "Agreement of each view, in input order.");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Estimates camera, hand-eye poses, marker map and arm together from pixels and robot postures, each with its noise.
///
/// The fit is a Problem: pixels along the chain camera, flange, base, target, marker; each stop has an error of its
/// robot pose, which is eliminated. Parameters of the arm are tied to the nominal ones by the spread `tolerance_length`
/// and `tolerance_angle`. Of the camera fx, fy, cx, cy and the lens coefficients that are not 0 are free; the marker of
/// the lowest id defines the frame of the map. Noise of robot and pixels and the spreads are estimated by restricted
/// maximum likelihood (Förstner 1979), from the levels that calibrate_hand_eye finds; the ratio of the robot's position
/// and rotation noise stays the one found there. Views that contradict the others are those of calibrate_hand_eye with
/// the calibrated cell. Profiles of a line scanner share the arm; their noise and outliers are those that
/// calibrate_scanner finds.
///
/// Data that cannot determine the answer give `fit.status == FitStatus::Degenerate` and the reason in `fit.message`.
/// Two poses of the camera that calibrate_hand_eye cannot tell apart are no such reason: the calibration begins at
/// both.
/// @throws InvalidArgument for what calibrate_hand_eye and calibrate_scanner refuse, joint values that do not fit the
/// arm, points of markers that are not listed, unknown names in `hold`, or invalid options.
CellCalibrationResult calibrate_cell(std::span<const CellStop> stops, const CellGeometry& believed,
                                     const CellCalibrationOptions& options = {}, const CellScan& scan = {});

/// A view that was left out, and the error with which it was predicted.
struct CellHeldOutView {
  std::string name;
  double rms_px = 0.0;           ///< [px]
  double separate_rms_px = 0.0;  ///< [px]

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the view.");
    visit("rms_px", self.rms_px, "RMS distance of seen and predicted points, the cell calibrated together [px].");
    visit("separate_rms_px", self.separate_rms_px,
          "The same with the camera, markers and arm as they were given and the hand-eye poses calibrated alone [px].");
  }
};

/// Predicts views that took no part, each fold from the others, with the joint and with the separate calibration. The
/// latter is favoured where its camera was calibrated from all the images.
/// @throws InvalidArgument as calibrate_cell does, for fewer than six stops, or fewer than two folds.
std::vector<CellHeldOutView> evaluate_cell(std::span<const CellStop> stops, const CellGeometry& believed,
                                           const CellCalibrationOptions& options = {}, int folds = 5);

}  // namespace kr5::calibration
