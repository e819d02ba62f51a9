// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <kr5/calibration/estimated_parameter.hpp>
#include <kr5/calibration/kinematics.hpp>
#include <kr5/calibration/profile_features.hpp>
#include <kr5/fit/pipeline/second_minimum.hpp>
#include <kr5/fit/solution.hpp>

/// @file
/// Calibration of a line scanner on the flange from profiles of tips, spheres and planes, with or without the arm's own
/// parameters (Hayat et al. 2022, section 2.2.4).

namespace kr5::calibration {

/// What stands still in the base and is scanned.
struct ScanTarget {
  std::string name;
  ScanTargetKind kind = ScanTargetKind::Tip;
  std::optional<Eigen::Vector3d> position;  ///< [m]
  std::optional<Eigen::Vector3d> normal;    ///< [-]
  double radius = 0.0;                      ///< [m]
  double sigma = 0.0;                       ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the target.");
    visit("kind", self.kind, "Kind: tip | sphere | plane.");
    visit("position", self.position,
          "Known place of the tip, of the centre of the sphere or of a point of the plane in the base [m]; without, "
          "estimated.");
    visit("normal", self.normal, "Known normal of a plane in the base [-]; with the position.");
    visit("radius", self.radius, "Radius of a sphere [m]; 0: estimated.");
    visit("sigma", self.sigma, "Standard deviation of a known position per axis [m]; 0: exact.");
  }
};

/// What one profile shows of a target, and where the flange was.
struct ScannerView {
  std::string name;
  std::string target;
  Pose T_base_flange = Pose::Identity();
  Eigen::VectorXd q;  ///< [rad or m]
  ProfileFeature feature;

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the profile.");
    visit("target", self.target, "Name of the target.");
    visit("T_base_flange", self.T_base_flange, "Flange in the base; with joint values and an arm, not used.");
    visit("q", self.q, "Joint values [rad or m]; needed where the arm is refined.");
    visit("feature", self.feature, "What the profile shows, as find_profile_feature gives it.");
  }
};

struct ScannerOptions {
  double sigma_position = 0.0;        ///< [m]
  double sigma_across = 0.0;          ///< [m]
  double sigma_rotation = 0.0;        ///< [rad]
  double tolerance_length = 0.0;      ///< [m]
  double tolerance_angle = 0.0;       ///< [rad]
  double outlier_false_alarm = 0.01;  ///< [-]
  int folds = 5;
  int max_iterations = 100;
  std::optional<Pose> T_flange_scanner = std::nullopt;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("sigma_position", self.sigma_position,
          "Error of a profile per axis, of the robot and of its feature together, beyond the stated covariance of the "
          "feature [m]; 0: estimated.");
    visit("sigma_across", self.sigma_across,
          "Error of a tip across the profile: distance by which the line misses it [m]; 0: estimated from 15 tips or "
          "more, else the same as along the profile.");
    visit("sigma_rotation", self.sigma_rotation, "Error of the robot's orientation per axis [rad]; 0: none.");
    visit(
        "tolerance_length", self.tolerance_length,
        "Standard deviation of the arm's true lengths about the nominal ones, where it is refined [m]; 0: estimated.");
    visit("tolerance_angle", self.tolerance_angle, "The same of its angles [rad]; 0: estimated.");
    visit("outlier_false_alarm", self.outlier_false_alarm,
          "Probability of a false outlier in sound data, over all profiles [-].");
    visit("folds", self.folds,
          "Number of parts of the profiles that are left out in turn for the held-out error; 0: none.");
    visit("max_iterations", self.max_iterations, "Maximum number of iterations of one fit.");
    visit("T_flange_scanner", self.T_flange_scanner,
          "Nominal pose of the scanner; none is needed to start, but one shows mirrored and swapped coordinates.");
  }
};

/// How one profile agrees with the result.
struct ScannerViewReport {
  std::string name;
  std::string target;
  double distance = 0.0;     ///< [m]
  double held_out = 0.0;     ///< [m]
  double probability = 1.0;  ///< [-]
  bool outlier = false;

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the profile.");
    visit("target", self.target, "Name of the target.");
    visit("distance", self.distance,
          "Distance of what the profile shows from where the target is: of the tip, of the arc, or RMS of the line "
          "[m].");
    visit("held_out", self.held_out, "The same, predicted without this profile; 0: not computed [m].");
    visit("probability", self.probability, "Probability of a sound profile at this distance from all others [-].");
    visit("outlier", self.outlier, "True for a profile that contradicts the others beyond the noise.");
  }
};

/// A finding about the data, with what to do.
struct ScannerCause {
  std::string cause;
  std::string text;
  std::string remedy;

  static void each_field(auto& self, auto&& visit) {
    visit("cause", self.cause,
          "Cause: shifted_list | mirrored_x | mirrored_z | swapped_columns | scale | same_orientation | one_axis.");
    visit("text", self.text, "What was found.");
    visit("remedy", self.remedy, "What to do about it.");
  }
};

struct ScannerResult {
  Pose T_flange_scanner = Pose::Identity();
  Matrix6 covariance = Matrix6::Zero();  ///< [m, rad]
  double dof = 0.0;                      ///< [-]
  kinematics::DhChain arm;
  std::vector<ScanTarget> targets;
  std::vector<EstimatedParameter> coordinates;
  Eigen::MatrixXd joint_covariance;
  std::vector<fit::UnidentifiableDirection> unidentifiable;
  double sigma_position = 0.0;    ///< [m]
  double sigma_across = 0.0;      ///< [m]
  double tolerance_length = 0.0;  ///< [m]
  double tolerance_angle = 0.0;   ///< [rad]
  double rms = 0.0;               ///< [m]
  double held_out_rms = 0.0;      ///< [m]
  std::vector<ScannerViewReport> views;
  std::vector<ScannerCause> causes;
  std::optional<fit::pipeline::SecondMinimum> second;
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("T_flange_scanner", self.T_flange_scanner, "Scanner in the flange.");
    visit("covariance", self.covariance,
          covariance_doc("T_flange_scanner", "Its covariance, right perturbation [m, rad]."));
    visit("dof", self.dof,
          "Degrees of freedom behind the covariance, by which it is already inflated; a million: known noise [-].");
    visit("arm", self.arm, "Refined arm, where one was given; else without joints.");
    visit("targets", self.targets, "Targets, with what was estimated of them.");
    visit("coordinates", self.coordinates, "Every estimated number; of the scanner its change from the start.");
    visit("joint_covariance", self.joint_covariance, "Covariance, in the order and units of `coordinates`.");
    visit("unidentifiable", self.unidentifiable, "Combinations that the profiles alone do not determine.");
    visit("sigma_position", self.sigma_position, "Error of a profile per axis, given or estimated [m].");
    visit("sigma_across", self.sigma_across, "Error of a tip across the profile, given or estimated [m].");
    visit("tolerance_length", self.tolerance_length, "Spread of true about nominal lengths, given or estimated [m].");
    visit("tolerance_angle", self.tolerance_angle, "Spread of true about nominal angles, given or estimated [rad].");
    visit("rms", self.rms, "RMS distance of the profiles, outliers apart [m].");
    visit("held_out_rms", self.held_out_rms, "The same of profiles left out of the fit; 0: not computed [m].");
    visit("views", self.views, "Agreement of each profile, in input order.");
    visit("causes", self.causes, "Findings about the data.");
    visit("second", self.second,
          "Another pose of the scanner with nearly the same cost; where the two cannot be told apart, the fit is not "
          "usable.");
    visit("fit", self.fit, "Report of the estimation.");
  }
};

/// Estimates the pose of a line scanner on the flange from profiles of targets that stand still in the base.
///
/// Places of targets may be known or not, each in several profiles. No nominal pose is needed: tips, spheres and known
/// planes give a closed form and are searched over all rotations, an unknown plane over its normals; of the minima of
/// the cost the best is taken. The noise is estimated unless given;
/// profiles that contradict the others are named and left out. With `arm` its parameters are refined, too, held to
/// spread about the nominal ones. A pose that the profiles leave open gives FitStatus::Degenerate, with the direction
/// in words.
/// @throws InvalidArgument for fewer than four profiles, a view without a usable feature, a target that nobody or
/// nothing names, NaN, or invalid options.
ScannerResult calibrate_scanner(std::span<const ScannerView> views, std::span<const ScanTarget> targets,
                                const ScannerOptions& options = {},
                                const std::optional<kinematics::DhChain>& arm = std::nullopt);

}  // namespace kr5::calibration
