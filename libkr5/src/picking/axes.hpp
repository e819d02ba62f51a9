// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include <Eigen/Geometry>

#include <kr5/geometry/pose.hpp>

namespace kr5::picking {

/// A right-handed frame whose third column is this direction.
inline Eigen::Matrix3d axes_about(const Eigen::Vector3d& direction) {
  Eigen::Matrix3d out;
  const Eigen::Vector3d z = direction.normalized();
  const Eigen::Vector3d x = (std::abs(z.x()) < 0.7 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY());
  out.col(2) = z;
  out.col(0) = (x - z * z.dot(x)).normalized();
  out.col(1) = z.cross(out.col(0));
  return out;
}

}  // namespace kr5::picking
