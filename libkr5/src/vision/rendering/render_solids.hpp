// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <kr5/geometry/placed.hpp>

#include "vision/rendering/render_surface.hpp"

/// @file
/// Rays meet solids, which one light from the upper left behind the camera shades.

namespace kr5::vision {

/// What a ray sees: how light, and the face of which solid; 0: a sheet, or nothing.
struct Seen {
  float grey = nothing;
  int of = 0;

  /// Seen by two rays, there is an edge between them.
  bool differs(const Seen& other) const { return of != other.of || (of == 0 && grey != other.grey); }
};

class SolidSurface {
 public:
  SolidSurface(const PlacedSolid& placed, int number)
      : solid_(placed.solid), T_camera_solid_(placed.T_camera_solid), number_(number) {
    T_solid_camera_ = T_camera_solid_.inverse();
    centre_ = T_camera_solid_ * solid_.centre();
  }

  /// Depth along a ray through z = 1, and what is seen there.
  double hit(const Eigen::Vector3d& ray, Seen& seen) const {
    const RayHit met = solid_.intersect({T_solid_camera_.translation(), T_solid_camera_.linear() * ray});
    if (!met.hit()) return met.distance;
    static const Eigen::Vector3d to_light = Eigen::Vector3d(-0.4, -0.6, -0.7).normalized();
    const double lit = 0.35 + 0.65 * std::max(0.0, to_light.dot(T_camera_solid_.linear() * met.normal));
    constexpr std::array<double, 4> of_face = {1.0, 1.0, 0.35, 0.15};  // little light falls into a bore
    const auto face = static_cast<std::size_t>(met.face);
    seen = {static_cast<float>(solid_.grey * lit * of_face[face]), 1 + 4 * number_ + static_cast<int>(face)};
    return met.distance;
  }

  /// False when it surely lies outside the cone about `axis` whose half angle is `half`.
  bool may_lie_in(const Eigen::Vector3d& axis, double half) const {
    const double distance = centre_.norm(), reach = solid_.bounding_radius();
    if (!(distance > reach)) return true;
    return !(std::acos(std::clamp(axis.dot(centre_) / distance, -1.0, 1.0)) > half + std::asin(reach / distance));
  }

 private:
  Solid solid_;
  Pose T_camera_solid_, T_solid_camera_;
  Eigen::Vector3d centre_;
  int number_;
};

/// What a part of the picture may show.
struct Candidates {
  std::vector<const Surface*> sheets;
  std::vector<const SolidSurface*> solids;

  bool empty() const { return sheets.empty() && solids.empty(); }

  /// The nearest wins; a sheet on a solid is seen, and of sheets in one plane the last.
  Seen trace(const Eigen::Vector3d& ray) const {
    Seen seen;
    double nearest = std::numeric_limits<double>::infinity();
    for (const SolidSurface* s : solids) {
      Seen here;
      const double depth = s->hit(ray, here);
      if (depth < nearest) seen = here, nearest = depth;
    }
    for (const Surface* s : sheets) {
      const Hit hit = s->hit(ray);
      if (!(hit.depth <= nearest * (1 + 1e-9))) continue;
      const float here = s->grey(hit);
      if (here != nothing) seen = {here, 0}, nearest = hit.depth;
    }
    return seen;
  }
};

}  // namespace kr5::vision
