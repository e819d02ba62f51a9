// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include <kr5/geometry/pose.hpp>

/// @file
/// The tilt of a body whose spin about its own axis does not count: the rotation vector (-sin, cos) of the azimuth
/// towards which its Z leans, times the angle [rad], so that nothing happens at an angle of zero. No call allocates.

namespace kr5 {

/// Of a tilt towards an azimuth.
inline Eigen::Vector2d tilt_vector(double tilt, double azimuth) noexcept {
  return tilt * Eigen::Vector2d(-std::sin(azimuth), std::cos(azimuth));
}

/// At p [m], tilted by rho [rad], without spin.
inline Pose tilted_pose(const Eigen::Vector3d& p, const Eigen::Vector2d& rho) noexcept {
  Pose out(Eigen::Translation3d{p});
  const double angle = rho.norm();
  if (angle > 0) out.rotate(Eigen::AngleAxisd(angle, Eigen::Vector3d(rho.x() / angle, rho.y() / angle, 0.0)));
  return out;
}

/// Of the Z axis of a pose, whatever its spin [rad].
inline Eigen::Vector2d tilt_of(const Pose& T) noexcept {
  const Eigen::Vector3d axis = T.linear().col(2);
  const double across = std::hypot(axis.x(), axis.y());
  if (across < 1e-15) return Eigen::Vector2d::Zero();
  return std::atan2(across, axis.z()) / across * Eigen::Vector2d(-axis.y(), axis.x());
}

}  // namespace kr5
