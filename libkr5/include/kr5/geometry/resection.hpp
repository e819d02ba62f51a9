// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// Pose of known points from where a camera sees them.

namespace kr5 {

struct ResectionOptions {
  int max_iterations = 50;
  double huber = 3.5;  ///< [-]

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("max_iterations", self.max_iterations, "Maximum number of steps of the refinement.");
    visit("huber", self.huber,
          "Huber threshold in robust standard deviations, beyond which a point counts less; 0: off [-].");
  }
};

/// One pose that explains the pixels: a local optimum of the (Huber) reprojection error.
struct Resection {
  Pose T_camera_points = Pose::Identity();
  double rms_px = 0.0;                    ///< Over all points, per point (not per axis) [px].
  double cost = 0.0;                      ///< Sum of weighted squared residuals [px^2].
  Matrix6 information = Matrix6::Zero();  ///< Of the pose, right perturbation, for pixel noise of 1 px.
  Eigen::VectorXd weights;                ///< Weight of each point, 1 for a sound one [-].
};

/// Poses of `points` (target frame, 3 x n [m], n >= 4) in the camera from `pixels` (2 x n [px]), best first.
///
/// Points on a plane have up to two local optima, of which a small or distant target cannot identify the right one
/// (Schweighofer and Pinz 2006): both are returned. Empty when the points lie on a line, or no pose puts them in
/// front of the camera.
/// @throws InvalidArgument for other shapes, fewer than four points, or NaN.
std::vector<Resection> resect(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& pixels, const Pinhole& camera,
                              const ResectionOptions& options = {});

}  // namespace kr5
