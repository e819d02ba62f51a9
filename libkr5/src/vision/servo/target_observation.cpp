// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/vision/target_observation.hpp>

#include <kr5/core/error.hpp>
#include <kr5/vision/target_pose.hpp>

#include "vision/cv_view.hpp"
#include "vision/undistort.hpp"

namespace kr5::vision {

TargetObservation observe_target(ImageView image, const Target& target, const Pinhole& camera,
                                 const DetectOptions& options) {
  require_image(image);
  camera.validate();
  require(image.width == camera.width && image.height == camera.height,
          "observe_target: image and camera must have the same size [px]");
  TargetObservation observation;
  const PlainView plain = undistort(image, camera);
  const Detection detection = find_target(plain.image, target, options);
  observation.message = detection.message;
  if (!detection.found()) return observation;
  const TargetPose pose = estimate_target_pose(detection.view, plain.camera, {.correlation = detection.correlation});
  observation.message = pose.fit.message;
  if (!pose.fit.usable() || pose.ambiguous) return observation;
  observation.T_camera_target = pose.T_camera_target;
  observation.points = detection.view.points;
  const Pinhole& c = plain.camera;
  observation.rays =
      (detection.view.pixels.colwise() - Eigen::Vector2d(c.cx, c.cy)).array().colwise() / Eigen::Array2d(c.fx, c.fy);
  observation.seen = true;
  return observation;
}

TargetObservation observe_hole(const HoleDetection& hole) {
  TargetObservation observation;
  observation.message = hole.message;
  if (!hole.found()) return observation;
  observation.T_camera_target = hole.T_camera_hole;
  const double r = 2 * hole.radius;
  observation.points.resize(3, 4);
  observation.points << r, 0, -r, 0, 0, r, 0, -r, 0, 0, 0, 0;
  observation.rays = (observation.T_camera_target * observation.points).colwise().hnormalized();
  observation.seen = true;
  return observation;
}

}  // namespace kr5::vision
