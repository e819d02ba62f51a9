// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

/// @file
/// Peg and tube as bodies of revolution.

namespace kr5::force {

/// A conical, cylindrical or flat face: the half-plane normal . (radius, axial) <= offset.
struct Face {
  Eigen::Vector2d normal = Eigen::Vector2d::Zero();
  double offset = 0.0;
};

/// A circle where two faces meet.
struct Edge {
  double radius = 0.0, axial = 0.0;
  int first = 0, second = 0;
};

/// A body of revolution whose profile is a convex polygon: inside where it is below all faces.
struct Body {
  std::array<Face, 5> faces;
  int face_count = 0;
  std::array<Edge, 3> edges;
  int edge_count = 0;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero(), u = Eigen::Vector3d::UnitX(), v = Eigen::Vector3d::UnitY(),
                  axis = Eigen::Vector3d::UnitZ();

  int add_face(double radial, double axial, double offset) noexcept {
    faces[static_cast<std::size_t>(face_count)] = {{radial, axial}, offset};
    return face_count++;
  }
  void add_edge(const Edge& edge) noexcept { edges[static_cast<std::size_t>(edge_count++)] = edge; }
  Eigen::Vector3d edge_point(const Edge& e, double angle) const noexcept {
    return origin + e.axial * axis + e.radius * (std::cos(angle) * u + std::sin(angle) * v);
  }
  Eigen::Vector3d tangent(double angle) const noexcept { return std::cos(angle) * v - std::sin(angle) * u; }
  Eigen::Vector3d outward(const Eigen::Vector3d& point) const noexcept {
    const Eigen::Vector3d d = point - origin;
    return (d - axis.dot(d) * axis).normalized();
  }
  Eigen::Vector3d face_normal(int face, const Eigen::Vector3d& point) const noexcept {
    const Eigen::Vector2d& n = faces[static_cast<std::size_t>(face)].normal;
    return n.x() * outward(point) + n.y() * axis;
  }
};

struct Depth {
  double value = 0.0;  ///< Distance to the nearest face, negative outside [m].
  int face = -1;
};

/// An edge as another body sees it: height along that body's axis and squared distance from its origin are sums of
/// 1, cos and sin of the angle, so that a point costs one square root.
class Track {
 public:
  Track(const Body& owner, const Edge& e, const Body& in) noexcept : in_(in) {
    const Eigen::Vector3d d = owner.origin + e.axial * owner.axis - in.origin;
    axial_ = {in.axis.dot(d), e.radius * in.axis.dot(owner.u), e.radius * in.axis.dot(owner.v)};
    square_ = {d.squaredNorm() + e.radius * e.radius, 2 * e.radius * d.dot(owner.u), 2 * e.radius * d.dot(owner.v)};
  }

  /// At the angle with this cosine and sine.
  Depth at(double cosine, double sine) const noexcept {
    const double axial = axial_[0] + axial_[1] * cosine + axial_[2] * sine;
    const double square = square_[0] + square_[1] * cosine + square_[2] * sine;
    const double radius = std::sqrt(std::max(0.0, square - axial * axial));
    Depth least{1e300, -1};
    for (int i = 0; i < in_.face_count; ++i) {
      const Face& f = in_.faces[static_cast<std::size_t>(i)];
      const double depth = f.offset - f.normal.x() * radius - f.normal.y() * axial;
      if (depth < least.value) least = {depth, i};
    }
    return least;
  }

 private:
  const Body& in_;
  std::array<double, 3> axial_, square_;
};

}  // namespace kr5::force
