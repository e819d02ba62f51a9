// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Core>

#include <kr5/picking/pellets.hpp>

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
    bool hits() const { return in < out; }
  };
  /// The same of a cylinder without ends.
  Chord side_chord(const Eigen::Vector3d& q, const Eigen::Vector3d& e) const {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const double a = e.head<2>().squaredNorm(), b = q.head<2>().dot(e.head<2>());
    const double c = q.head<2>().squaredNorm() - radius * radius, discriminant = b * b - a * c;
    if (a <= 1e-12) return c > 0 ? Chord{} : Chord{-infinity, infinity};
    if (discriminant <= 0) return {};
    return {(-b - std::sqrt(discriminant)) / a, (-b + std::sqrt(discriminant)) / a};
  }
  Chord chord(const Eigen::Vector3d& q, const Eigen::Vector3d& e) const {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const Chord side = side_chord(q, e);
    if (!side.hits()) return {};
    const double half = height / 2;
    double face_in = -infinity, face_out = infinity;
    if (std::abs(e.z()) > 1e-9) {
      face_in = ((e.z() > 0 ? -half : half) - q.z()) / e.z();
      face_out = ((e.z() > 0 ? half : -half) - q.z()) / e.z();
    } else if (std::abs(q.z()) > half) {
      return {};
    }
    return {std::max(side.in, face_in), std::min(side.out, face_out)};
  }

  /// Least distance from this one's surface of points spread over the side and the rims of another; negative inside.
  double distance_to_side_of(const SolidCylinder& other) const {
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 24; ++k)
      for (const double z : {-0.5, -0.25, 0.0, 0.25, 0.5}) {
        const double angle = 2 * std::numbers::pi * k / 24;
        const Eigen::Vector3d q(other.radius * std::cos(angle), other.radius * std::sin(angle), z * other.height);
        least = std::min(least, distance(local(other.centre + other.frame * q)));
      }
    return least;
  }
};

inline SolidCylinder solid_of(const Pellet& pellet) {
  return {pellet.frame, pellet.centre, pellet.radius, pellet.height};
}

}  // namespace kr5::picking
