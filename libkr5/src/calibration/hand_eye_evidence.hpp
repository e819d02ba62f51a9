// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include <kr5/calibration/hand_eye.hpp>

/// @file
/// Private: one way of reading a hand-eye data set, fitted quickly, with its likelihood, for a diagnosis to compare
/// many. Each view is reduced to the pose in which it saw the target and that pose's covariance; the robot's noise is
/// estimated along (maximum likelihood). The answer to a user comes from the fit over pixels in hand_eye_fit.hpp.

namespace kr5::calibration::evidence {

/// The target in one image: one pose, or the two that a plane may have.
struct Sighting {
  struct Solution {
    Pose T_camera_target = Pose::Identity();
    Matrix6 covariance = Matrix6::Zero();  ///< Right perturbation [m, rad].
    double excess = 0.0;                   ///< Squared error above the best solution, in units of the noise [-].
  };
  std::vector<Solution> solutions;
};

struct Sightings {
  std::vector<Sighting> views;
  std::vector<int> index;    ///< Position of each among the views given; those without a pose are left out.
  double squared_sum = 0.0;  ///< Of the pixel residuals [px^2].
  double freedom = 0.0;      ///< Their degrees of freedom.
  double sigma_pixel = 0.0;  ///< [px]
  /// -2 log likelihood of the pixels, the noise being estimated.
  double score() const;
};

Sightings see(std::span<const View> views, const Pinhole& camera);

/// What is believed about robot poses and sightings, and what is left free.
struct Reading {
  Mount mount = Mount::EyeInHand;
  std::vector<Pose> robot;        ///< T_base_flange of each pair.
  std::vector<int> sighting;      ///< Which sighting belongs to it.
  std::vector<Vector6> drift;     ///< Motion of the robot per unit of lag; empty: no lag.
  int split = 0;                  ///< First pair after the target was moved; 0: it was not.
  bool free_scale = false;        ///< The target's size is unknown.
  std::vector<double> inflation;  ///< Variance factor of each pair; empty: all 1.

  int size() const { return static_cast<int>(robot.size()); }
  /// Continuous parameters beside the two poses.
  int extra() const { return (split > 0 ? 6 : 0) + (free_scale ? 1 : 0) + (drift.empty() ? 0 : 1); }
};

struct Fit {
  bool usable = false;
  Pose X = Pose::Identity();        ///< T_mount_camera
  Pose Y = Pose::Identity();        ///< T_fixed_target
  Pose Y_after = Pose::Identity();  ///< The same after the split.
  double scale = 1.0;
  double lag = 0.0;
  double sigma_position = 0.0;      ///< [m]
  double sigma_rotation = 0.0;      ///< [rad]
  double score = 0.0;               ///< -2 log likelihood of the robot poses, without the constant.
  std::vector<double> chi_squared;  ///< Of each pair, six degrees of freedom.
  Eigen::MatrixXd covariance;       ///< Of X, Y, (Y_after, scale, lag).
};

/// Maximum likelihood of one reading. `usable` is false when nothing could be fitted.
Fit fit(const Reading& reading, const Sightings& sightings);
/// Squared error [m^2] of a point at the target's distance, the better of a plane's two poses counting.
double misplaced(const Pose& T_base_flange, const Sighting& sighting, const Fit& fit, Mount mount);
/// RMS error [m] of a point at the target's distance, on pairs left out in turn (at most `folds` fits).
double held_out_rms(const Reading& reading, const Sightings& sightings, int folds = 6);

/// How the flange pose misses what the camera says, right perturbation of the robot pose [m, rad].
Vector6 residual(const Pose& T_base_flange, const Pose& T_camera_target, const Pose& X, const Pose& Y, Mount mount);
/// How a small error of the sighting, right perturbation, moves the flange pose it implies.
Matrix6 by_sighting(const Pose& T_camera_target, const Pose& X, const Pose& Y, Mount mount);
/// The same for X and Y.
Matrix6 by_X(const Pose& T_camera_target, const Pose& X, const Pose& Y, Mount mount);
Matrix6 by_Y(const Pose& T_camera_target, const Pose& X, const Pose& Y, Mount mount);

}  // namespace kr5::calibration::evidence
