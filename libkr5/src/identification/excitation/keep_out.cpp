// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/keep_out.hpp>

#include <algorithm>
#include <cmath>

#include <kr5/core/error.hpp>
#include <kr5/io/fields.hpp>

namespace kr5::identification {
namespace {

using Eigen::Vector3d;

struct KeepOutFile {
  std::vector<KeepOut> keep_out;

  static constexpr std::array<std::string_view, 1> required = {"keep_out"};
  static void each_field(auto& self, auto&& visit) { visit("keep_out", self.keep_out, "Zones."); }
};

/// Of a point from a box about the origin.
double box_distance(const Vector3d& point, const Vector3d& half) {
  return (point.cwiseAbs() - half).cwiseMax(0.0).norm();
}

/// Of a segment from a box about the origin. Half the square of the distance of a point of the segment is convex in its
/// place u; its derivative rises linearly between the places where the segment crosses planes of faces.
double box_distance(const LineSegment& segment, const Vector3d& half) {
  const Vector3d way = segment.to - segment.from;
  const auto slope = [&](double u) {
    const Vector3d point = segment.from + u * way;
    return way.dot(point - point.cwiseMax(-half).cwiseMin(half));
  };
  std::array<double, 8> places;
  places.fill(1.0);
  places[0] = 0.0;
  std::size_t count = 1;
  for (int axis = 0; axis < 3; ++axis)
    for (const double face : {-half[axis], half[axis]}) {
      const double u = (face - segment.from[axis]) / way[axis];  // of no length along the axis: not between 0 and 1
      if (u > 0.0 && u < 1.0) places[count++] = u;
    }
  std::sort(places.begin(), places.end());
  double u = 0.0, before = slope(0.0);
  for (std::size_t k = 1; k < places.size() && before < 0.0; ++k) {
    const double next = slope(places[k]);
    u = next > 0.0 ? places[k - 1] + (places[k] - places[k - 1]) * before / (before - next) : places[k];
    before = next;
  }
  return box_distance(segment.from + u * way, half);
}

double point_distance(const LineSegment& segment, const Vector3d& point) {
  const Vector3d way = segment.to - segment.from;
  const double squared = way.squaredNorm();
  const double u = squared > 0.0 ? std::clamp(way.dot(point - segment.from) / squared, 0.0, 1.0) : 0.0;
  return (segment.from + u * way - point).norm();
}

}  // namespace

void KeepOut::validate() const {
  const std::string zone = "keep_out '" + name + "': ";
  require(T_base_object.matrix().allFinite(), zone + "T_base_object must be finite [m, rad]");
  if (kind == KeepOutKind::Box)
    require(size.allFinite() && size.minCoeff() >= 0.0 && size.maxCoeff() > 0.0,
            zone + "size must be three lengths that are not negative, and not all 0 [m]");
  if (kind == KeepOutKind::Ball) require(radius > 0.0 && std::isfinite(radius), zone + "radius must be positive [m]");
}

double KeepOut::distance(const LineSegment& segment) const {
  if (kind == KeepOutKind::Ball) return point_distance(segment, T_base_object.translation()) - radius;
  const Pose T_object_base = T_base_object.inverse();
  const LineSegment inside{T_object_base * segment.from, T_object_base * segment.to};
  if (kind == KeepOutKind::Floor) return std::min(inside.from.z(), inside.to.z());
  return box_distance(inside, 0.5 * size);
}

KeepOut keep_out_of(const cell::PlacedObject& object) {
  object.validate();
  KeepOut out{.name = object.name.empty() ? std::string(name_of(object.kind)) : object.name};
  out.T_base_object = object.T_base_object;
  if (object.kind == SolidKind::Ball) {
    out.kind = KeepOutKind::Ball;
    out.radius = object.radius;
  } else if (object.kind == SolidKind::Plate) {
    out.size = {object.width, object.height, 0.0};
  } else {
    out.size = {2 * object.radius, 2 * object.radius, object.depth};
    out.T_base_object.translate(Vector3d(0.0, 0.0, -0.5 * object.depth));
  }
  return out;
}

std::vector<KeepOut> load_keep_out(const std::filesystem::path& file) {
  const std::vector<KeepOut> out = io::load<KeepOutFile>(file).keep_out;
  require(!out.empty(), file.string() + ": keep_out: found no zone, expected at least one");
  for (const KeepOut& zone : out) zone.validate();
  return out;
}

}  // namespace kr5::identification
