// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/geometry/pose.hpp>

/// @file
/// Private: the motion between two sets of points.

namespace kr5::calibration {

/// Rotation and shift that carry points to others, in the sense of least squares (Kabsch 1976).
inline Pose rigid_motion(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to) {
  const Eigen::Vector3d a = from.rowwise().mean(), b = to.rowwise().mean();
  Pose T = Pose::Identity();
  T.linear() = nearest_rotation((to.colwise() - b) * (from.colwise() - a).transpose());
  T.translation() = b - T.linear() * a;
  return T;
}

}  // namespace kr5::calibration
