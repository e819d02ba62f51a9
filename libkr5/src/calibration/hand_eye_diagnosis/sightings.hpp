// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/geometry/view.hpp>

/// @file
/// Poses in which the target was seen.

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
  /// Poses without a covariance, which are worse from one view than from another: those of single images of a plane.
  bool noise_varies = false;
  /// -2 log likelihood of the pixels, the noise being estimated.
  double score() const;
};

Sightings find_sightings(std::span<const View> views, const Pinhole& camera);

}  // namespace kr5::calibration::evidence
