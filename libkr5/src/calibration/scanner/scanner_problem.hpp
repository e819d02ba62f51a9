// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/calibration/scanner.hpp>
#include <kr5/fit/problem.hpp>

/// @file
/// Private: the fit of a scanner calibration, built anew for each set of standard deviations.

namespace kr5::calibration::scanner_problem {

struct ScannerSigmas {
  double position = 3e-4;  ///< [m]
  double across = 3e-4;    ///< [m]
  double rotation = 0.0;   ///< [rad]
  double length = 1e-3;    ///< [m]
  double angle = 2e-3;     ///< [rad]
};

/// Where a target is: the tip, the centre, or a plane z = 0.
struct TargetPlacement {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Pose T_base_plane = Pose::Identity();
  double radius = 0.0;
};

struct ScannerPlacement {
  Pose T_flange_scanner = Pose::Identity();
  std::vector<TargetPlacement> targets;
};

struct ScannerInput {
  std::span<const ScannerView> views;
  std::span<const ScanTarget> targets;
  const ScannerOptions& options;
  const std::optional<kinematics::DhChain>& arm;
  std::vector<std::size_t> target_of;  ///< By view.
  std::vector<Pose> T_base_flange;     ///< By view, of the nominal arm where joint values are known.

  const ScanTarget& target(std::size_t view) const { return targets[target_of[view]]; }
};

/// A point of a profile in the frame of the scanner.
inline Eigen::Vector3d in_scanner(const Eigen::Vector2d& point) { return {point.x(), 0.0, point.y()}; }

/// What the profiles are in a fit.
struct ScannerBlocks {
  fit::FitBlock scanner;
  std::vector<fit::FitBlock> targets;  ///< Points, poses of planes.
  std::vector<fit::FitBlock> radii;
  std::vector<fit::FitMeasurement> observations;  ///< By view.
  std::vector<Eigen::MatrixXd> factors;           ///< By view, L with L L' the covariance of its residuals.
  std::vector<Eigen::VectorXd> shares;  ///< By view and residual, of the error of the profile in its variance.

  /// Begins where others ended.
  void begin_at(fit::Problem& fit, const ScannerBlocks& others, const fit::Problem& of_others) const;
};

/// Adds scanner, targets and profiles to a fit; with `arm` the flange is where its parameters put it. Covariances of
/// the residuals hold at `placement`.
ScannerBlocks add_scanner(fit::Problem& fit, fit::FitBlock arm, const ScannerInput& input, const ScannerSigmas& sigmas,
                          const ScannerPlacement& placement);

struct ScannerProblem : ScannerBlocks {
  fit::Problem fit;
  fit::FitBlock arm;

  /// Covariances of the residuals hold at `placement`.
  ScannerProblem(const ScannerInput& input, const ScannerSigmas& sigmas, const ScannerPlacement& placement);
  void begin_at(const ScannerProblem& other);
  void set_weights(const std::vector<double>& weights);
  ScannerPlacement placement(const ScannerInput& input) const;
  /// Residuals of a view in metres: 3 of tips and spheres, 2 of planes.
  Eigen::VectorXd residuals(std::size_t view) const;
  /// Distance that they say [m].
  double distance(std::size_t view) const;
};

}  // namespace kr5::calibration::scanner_problem
