// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include <Eigen/Core>

#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/vision/image.hpp>

/// @file
/// Measures a circle on a known plane at its edge in the image, dark inside, to a few hundredths of a pixel.

namespace kr5::vision {

/// A circle in the plane z = 0 of a frame.
struct PlaneCircle {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< [m]
  double radius = 0.0;                               ///< [m]
};

struct CircleEdge {
  PlaneCircle circle;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Of centre and radius [m^2].
  double rms_px = 0.0;                                   ///< [px]
  int edges = 0;                                         ///< Places at which the edge was seen.
  int places = 0;                                        ///< Places at which it was looked for.
};

/// The image, how it came about, and the plane in it.
struct PlaneView {
  ImageView image;
  const Pinhole& camera;
  Pose T_camera_plane;

  Eigen::Vector3d in_camera(const Eigen::Vector2d& p) const {
    return T_camera_plane * Eigen::Vector3d(p.x(), p.y(), 0.0);
  }
  /// Width of a pixel of the image on the plane, seen square on [m].
  double pixel_at(const Eigen::Vector2d& p) const { return in_camera(p).z() / camera.fx; }
  /// The whole circle, and a little more, lies inside the image.
  bool shows(const PlaneCircle& circle) const;
};

/// The circle near `guess`, whose centre may be off by a tenth of its radius. Empty when too few edges lie on a circle.
std::optional<CircleEdge> measure_circle(const PlaneView& view, const PlaneCircle& guess, double min_contrast);

}  // namespace kr5::vision
