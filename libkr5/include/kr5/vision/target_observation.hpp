// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/vision/find_hole.hpp>
#include <kr5/vision/find_target.hpp>

/// @file
/// What a camera sees of the target it is steered to.

namespace kr5::vision {

/// Observation of the target in one image. Create it by `observe_target` or `observe_hole`, or fill it from a tracker
/// of your own.
struct TargetObservation {
  bool seen = false;
  std::string message = "not run";  ///< Why it was not seen.
  Pose T_camera_target = Pose::Identity();
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd(3, 0);  ///< [m]
  Eigen::Matrix2Xd rays = Eigen::Matrix2Xd(2, 0);    ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("seen", self.seen, "Whether the target is in the image; the other fields are valid only then.");
    visit("message", self.message, "Reason why the target was not seen.");
    visit("T_camera_target", self.T_camera_target, "Pose of the target in the camera.");
    visit("points", self.points, "Points of the target in its own frame, 3 x n, for the feature image [m].");
    visit("rays", self.rays,
          "Normalised image coordinates x/z and y/z of the points, without lens distortion, 2 x n [-].");
  }
};

/// Searches for a target in the undistorted image: one marker alone cannot separate the bend of its sides from its
/// tilt. A view that two poses explain counts as not seen.
/// @throws InvalidArgument as find_target, and for an image of another size than the camera's.
TargetObservation observe_target(ImageView image, const Target& target, const Pinhole& camera,
                                 const DetectOptions& options = {});
/// Observation of a bore from the result of `find_hole`: Z is that of the known plane, the turn about it that of the
/// plane's frame (use `turn_free`), the rays are those of four points of the face two radii from the centre.
TargetObservation observe_hole(const HoleDetection& hole);

}  // namespace kr5::vision
