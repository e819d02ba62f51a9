// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include <kr5/geometry/mount.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/geometry/view.hpp>

/// @file
/// Poses in which the target was seen, and their effect on the pose of the flange.

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

Sightings find_sightings(std::span<const View> views, const Pinhole& camera);

/// How the flange pose misses what the camera says, right perturbation of the robot pose [m, rad].
Vector6 flange_residual(const Pose& T_base_flange, const Pose& T_camera_target, const Pose& X, const Pose& Y,
                        Mount mount);
/// How a small error of the sighting, right perturbation, moves the flange pose it implies.
Matrix6 flange_by_sighting(const Pose& T_camera_target, const Pose& X, const Pose& Y, Mount mount);
/// The same for X and Y.
Matrix6 flange_by_camera(const Pose& T_camera_target, const Pose& X, const Pose& Y, Mount mount);
Matrix6 flange_by_target(const Pose& T_camera_target, const Pose& X, const Pose& Y, Mount mount);

}  // namespace kr5::calibration::evidence
