// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include <kr5/calibration/hand_eye.hpp>

#include "calibration/hand_eye_diagnosis/sightings.hpp"

/// @file
/// Private: one way of reading a hand-eye data set, fitted quickly, with its likelihood, for a diagnosis to compare
/// many. Each view is reduced to the pose in which it saw the target and that pose's covariance; the robot's noise is
/// estimated along (maximum likelihood). The answer to a user comes from the fit over pixels in hand_eye/fit.hpp.

namespace kr5::calibration::evidence {

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

struct ReadingFit {
  bool usable = false;
  Pose X = Pose::Identity();        ///< T_mount_camera
  Pose Y = Pose::Identity();        ///< T_fixed_target
  Pose Y_after = Pose::Identity();  ///< The same after the split.
  double scale = 1.0;
  double lag = 0.0;
  double sigma_position = 0.0;      ///< Standard deviation per axis [m].
  double sigma_rotation = 0.0;      ///< Standard deviation per axis [rad].
  double score = 0.0;               ///< -2 log likelihood of the robot poses, without the constant.
  std::vector<double> chi_squared;  ///< Of each pair, six degrees of freedom.
  Eigen::MatrixXd covariance;       ///< Of X, Y, (Y_after, scale, lag).
};

/// Maximum likelihood of one reading. `usable` is false when nothing could be fitted.
ReadingFit fit_reading(const Reading& reading, const Sightings& sightings);

}  // namespace kr5::calibration::evidence
