// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/geometry/solid.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <kr5/core/error.hpp>

namespace kr5 {
namespace {

using Eigen::Vector3d;

/// The two solutions of a s^2 + 2 b s + c = 0 in order; NaN when there are none.
std::array<double, 2> roots(double a, double b, double c) {
  const double root = std::sqrt(b * b - a * c);
  const double q = -(b + std::copysign(root, b));  // no difference of nearly equal numbers
  const double one = q / a, two = q != 0.0 ? c / q : one;
  return {std::min(one, two), std::max(one, two)};
}

RayHit intersect_ball(const Solid& ball, const Ray& ray) {
  const auto s = roots(ray.direction.squaredNorm(), ray.direction.dot(ray.origin),
                       ray.origin.squaredNorm() - ball.radius * ball.radius);
  if (!(s[0] > 0.0)) return {};
  return {s[0], ray.at(s[0]).normalized(), SolidFace::Outside};
}

/// Nearer of two meetings.
void take(RayHit& best, double distance, const Vector3d& normal, SolidFace face) {
  if (distance > 0.0 && distance < best.distance) best = {distance, normal, face};
}

RayHit intersect_tube(const Solid& tube, const Ray& ray) {
  RayHit best;
  const auto flat = [&](double z, double inner, double outer, SolidFace face) {
    const double s = (z - ray.origin.z()) / ray.direction.z();
    if (!std::isfinite(s)) return;
    const double r = ray.at(s).head<2>().norm();
    if (r >= inner && r <= outer) take(best, s, Vector3d::UnitZ(), face);
  };
  const auto wall = [&](double radius, double out, SolidFace face) {
    const auto s = roots(ray.direction.head<2>().squaredNorm(), ray.direction.head<2>().dot(ray.origin.head<2>()),
                         ray.origin.head<2>().squaredNorm() - radius * radius);
    for (const double at : s) {
      const Vector3d p = ray.at(at);
      if (p.z() <= 0.0 && p.z() >= -tube.depth) take(best, at, Vector3d(p.x(), p.y(), 0.0) * (out / radius), face);
    }
  };
  flat(0.0, tube.inner_radius, tube.radius, SolidFace::Top);
  flat(-tube.depth, 0.0, tube.radius, SolidFace::Bottom);
  wall(tube.radius, 1.0, SolidFace::Outside);
  if (tube.inner_radius > 0.0) wall(tube.inner_radius, -1.0, SolidFace::Bore);
  return best;
}

RayHit intersect_plate(const Solid& plate, const Ray& ray) {
  const double s = -ray.origin.z() / ray.direction.z();
  const Vector3d p = ray.at(s);
  if (!(s > 0.0) || !(std::abs(p.x()) <= plate.width / 2 && std::abs(p.y()) <= plate.height / 2)) return {};
  return {s, Vector3d::UnitZ() * (ray.origin.z() < 0.0 ? -1.0 : 1.0), SolidFace::Top};
}

}  // namespace

void Solid::validate() const {
  const auto positive = [](double value, const char* field) {
    require(std::isfinite(value) && value > 0.0, std::string(field) + ": must be positive");
  };
  require(grey >= 0.0 && grey <= 255.0, "grey: must be 0 to 255");
  if (kind == SolidKind::Plate) {
    positive(width, "width");
    positive(height, "height");
    return;
  }
  positive(radius, "radius");
  if (kind == SolidKind::Ball) return;
  positive(depth, "depth");
  require(inner_radius >= 0.0 && inner_radius < radius, "inner_radius: must be 0 or more, and less than radius");
}

RayHit Solid::intersect(const Ray& ray) const {
  switch (kind) {
    case SolidKind::Ball:
      return intersect_ball(*this, ray);
    case SolidKind::Tube:
      return intersect_tube(*this, ray);
    case SolidKind::Plate:
      return intersect_plate(*this, ray);
  }
  return {};
}

double Solid::bounding_radius() const {
  if (kind == SolidKind::Ball) return radius;
  return kind == SolidKind::Tube ? std::hypot(radius, depth / 2) : std::hypot(width, height) / 2;
}

Eigen::Vector3d Solid::centre() const { return {0.0, 0.0, kind == SolidKind::Tube ? -depth / 2 : 0.0}; }

}  // namespace kr5
