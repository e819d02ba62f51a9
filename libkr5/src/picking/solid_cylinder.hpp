// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Core>

#include "axes.hpp"

namespace kr5::picking {

/// A cylinder with ends, and what rays and points are to it. Local coordinates: origin in the centre, Z along the axis.
struct SolidCylinder {
  Eigen::Matrix3d frame = Eigen::Matrix3d::Identity();  ///< Third column: the axis.
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();     ///< [m]
  double radius = 0.0;                                  ///< [m]
  double height = 0.0;                                  ///< [m]

  Eigen::Vector3d axis() const { return frame.col(2); }
  Eigen::Vector3d local(const Eigen::Vector3d& p) const { return frame.transpose() * (p - centre); }
  double bounding_radius() const { return std::hypot(radius, height / 2); }

  /// Distance of a point in local coordinates from the surface, negative inside.
  double distance(const Eigen::Vector3d& q) const {
    const double across = q.head<2>().norm() - radius, along = std::abs(q.z()) - height / 2;
    if (across > 0 && along > 0) return std::hypot(across, along);
    return std::max(across, along);
  }

  /// The part of a line q + s e, both local, inside the cylinder.
  struct Chord {
    double in = std::numeric_limits<double>::infinity();
    double out = -std::numeric_limits<double>::infinity();
    bool through_face = false;  ///< Whether it enters through an end.
    bool hits() const { return in < out; }
  };
  Chord chord(const Eigen::Vector3d& q, const Eigen::Vector3d& e) const {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const double a = e.head<2>().squaredNorm(), b = q.head<2>().dot(e.head<2>());
    const double c = q.head<2>().squaredNorm() - radius * radius, half = height / 2;
    double side_in = -infinity, side_out = infinity, face_in = -infinity, face_out = infinity;
    if (a > 1e-12) {
      const double discriminant = b * b - a * c;
      if (discriminant <= 0) return {};
      side_in = (-b - std::sqrt(discriminant)) / a;
      side_out = (-b + std::sqrt(discriminant)) / a;
    } else if (c > 0) {
      return {};
    }
    if (std::abs(e.z()) > 1e-9) {
      face_in = ((e.z() > 0 ? -half : half) - q.z()) / e.z();
      face_out = ((e.z() > 0 ? half : -half) - q.z()) / e.z();
    } else if (std::abs(q.z()) > half) {
      return {};
    }
    return {std::max(side_in, face_in), std::min(side_out, face_out), face_in > side_in};
  }
};

}  // namespace kr5::picking
