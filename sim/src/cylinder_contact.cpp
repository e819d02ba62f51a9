// SPDX-License-Identifier: BSD-3-Clause
#include "cylinder_contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace kr5::sim {
namespace {

using Eigen::Vector3d;

constexpr int rim_points = 16;
constexpr int rim_candidates = rim_points + 4;
constexpr int most_candidates = 4 * rim_candidates + 2;

struct CosSin {
  double c, s;
};

const std::array<CosSin, rim_points>& rim_angles() {
  static const auto table = [] {
    std::array<CosSin, rim_points> out{};
    for (int k = 0; k < rim_points; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / rim_points;
      out[static_cast<std::size_t>(k)] = {std::cos(angle), std::sin(angle)};
    }
    return out;
  }();
  return table;
}

struct SurfaceGap {
  Vector3d point;
  double gap;
  int feature;
};

struct SurfaceGaps {
  std::array<SurfaceGap, most_candidates> all;
  int count = 0;

  void add(const Vector3d& point, double gap, int feature) {
    all[static_cast<std::size_t>(count++)] = {point, gap, feature};
  }
};

/// The deepest, then always the one that is farthest from those taken; what is further apart counts for less.
ContactPatch choose(const SurfaceGaps& candidates, const Vector3d& normal, double radius) {
  constexpr double gap_weight = 5.0;
  ContactPatch patch;
  if (candidates.count == 0) return patch;
  std::array<double, most_candidates> distance;
  distance.fill(std::numeric_limits<double>::infinity());
  std::size_t next = 0;
  const auto count = static_cast<std::size_t>(candidates.count);
  for (std::size_t k = 1; k < count; ++k)
    if (candidates.all[k].gap < candidates.all[next].gap) next = k;
  const double least = candidates.all[next].gap;
  while (patch.count < ContactPatch::capacity) {
    const SurfaceGap& taken = candidates.all[next];
    patch.contacts[static_cast<std::size_t>(patch.count++)] = {taken.point, normal, taken.gap, taken.feature};
    double most = -std::numeric_limits<double>::infinity();
    std::size_t farthest = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const SurfaceGap& c = candidates.all[k];
      distance[k] = std::min(distance[k], (c.point - taken.point).norm());
      const double worth = distance[k] - gap_weight * (c.gap - least);
      if (distance[k] > 0.1 * radius && worth > most) most = worth, farthest = k;
    }
    if (!std::isfinite(most)) break;
    next = farthest;
  }
  return patch;
}

/// How far a cylinder reaches from its centre along a unit vector [m].
double support(const CylinderBody& body, const Vector3d& n) {
  const double along = n.dot(body.rotation.col(2));
  return body.half * std::abs(along) + body.radius * std::sqrt(std::max(0.0, 1.0 - along * along));
}

/// Width of the gap between two cylinders that planes normal to `n` (towards a) leave [m]: the greatest over all n is
/// their distance, or less than nothing the least shift that parts them.
double gap_along(const CylinderBody& a, const CylinderBody& b, const Vector3d& n) {
  return n.dot(a.centre - b.centre) - support(a, n) - support(b, n);
}

/// The direction of the widest gap. It often lies on a crease of `support`, along an axis or normal to one, so the
/// search starts from such directions and turns about the axes, which keeps to a crease.
Vector3d widest_gap(const CylinderBody& a, const CylinderBody& b, double margin, double& gap) {
  const Vector3d za = a.rotation.col(2), zb = b.rotation.col(2), between = a.centre - b.centre;
  Vector3d best = Vector3d::UnitZ();
  gap = -std::numeric_limits<double>::infinity();
  const auto consider = [&](const Vector3d& direction) {
    const double length = direction.norm();
    if (length < 1e-6) return false;
    const Vector3d n = direction / length;
    const double value = gap_along(a, b, n);
    if (value <= gap) return false;
    gap = value, best = n;
    return true;
  };
  const auto facing = [&](const Vector3d& v) { return Vector3d(v.dot(between) < 0.0 ? -v : v); };
  consider(between);
  consider(facing(za)), consider(facing(zb));
  consider(facing(za.cross(zb)));
  consider(between - between.dot(za) * za), consider(between - between.dot(zb) * zb);
  for (double turn = 0.3; turn > 1e-5 && gap <= margin;) {
    const Vector3d n = best;
    bool better = false;
    for (const Vector3d& z : {za, zb}) {
      const Vector3d about = z.cross(n), towards = z - z.dot(n) * n;
      for (const Vector3d& way : {about, towards}) {
        const double length = way.norm();
        if (length < 1e-9) continue;
        const Vector3d shift = turn / length * way;
        better |= consider(n + shift), better |= consider(n - shift);
      }
    }
    if (!better) turn *= 0.4;
  }
  return best;
}

/// Distance from a point along n to where the line leaves a cylinder, negative behind; NaN where the line misses it.
double way_out(const CylinderBody& body, const Vector3d& local, const Vector3d& n) {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  double first = -std::numeric_limits<double>::infinity(), last = -first;
  if (std::abs(n.z()) > 1e-9) {
    const double one = (body.half - local.z()) / n.z(), two = (-body.half - local.z()) / n.z();
    first = std::min(one, two), last = std::max(one, two);
  } else if (std::abs(local.z()) > body.half) {
    return none;
  }
  const double a = n.x() * n.x() + n.y() * n.y(), b = n.x() * local.x() + n.y() * local.y();
  const double c = local.x() * local.x() + local.y() * local.y() - body.radius * body.radius;
  if (a > 1e-16) {
    const double root = b * b - a * c;
    if (root < 0.0) return none;
    first = std::max(first, (-b - std::sqrt(root)) / a), last = std::min(last, (-b + std::sqrt(root)) / a);
  } else if (c > 0.0) {
    return none;
  }
  return first <= last ? last : none;
}

/// Angle of least gap near a sample of a rim, which may lie where the rim leaves the other cylinder: golden section.
double deepest_angle(int sample, const auto& gap) {
  const double golden = std::numbers::phi - 1.0, spacing = 2.0 * std::numbers::pi / rim_points;
  double low = (sample - 1) * spacing, high = (sample + 1) * spacing;
  double one = high - golden * (high - low), two = low + golden * (high - low), at_one = gap(one), at_two = gap(two);
  for (int i = 0; i < 9; ++i) {
    const bool left = at_one == at_two ? std::abs(one - sample * spacing) < std::abs(two - sample * spacing)
                                       : at_one < at_two;  // equal: both outside
    if (left) {
      high = two, two = one, at_two = at_one, one = high - golden * (high - low), at_one = gap(one);
    } else {
      low = one, one = two, at_one = at_two, two = low + golden * (high - low), at_two = gap(two);
    }
  }
  return at_one < at_two ? one : two;
}

/// Points of the rims of `a` that face `b`; n is the normal towards `a`.
void add_rims(const CylinderBody& a, const CylinderBody& b, const Vector3d& n, double margin, int feature,
              SurfaceGaps& out) {
  const Vector3d n_b = b.rotation.transpose() * n, across = n.cross(b.rotation.col(2));
  const Eigen::Matrix3d R_b_a = b.rotation.transpose() * a.rotation;
  const Vector3d t_b_a = b.rotation.transpose() * (a.centre - b.centre);
  const Vector3d u = a.radius * R_b_a.col(0), v = a.radius * R_b_a.col(1);
  const double lowest = n.dot(a.centre - b.centre) - support(b, n) - margin;
  for (int end = 0; end < 2; ++end, feature += rim_candidates) {
    const double side = end == 0 ? -a.half : a.half;
    if (lowest + side * n.dot(a.rotation.col(2)) > a.radius) continue;
    const Vector3d centre = t_b_a + side * R_b_a.col(2);
    const auto add = [&](double c, double s, int index) {
      const Vector3d p = centre + c * u + s * v;
      const double gap = -way_out(b, p, n_b);
      if (gap < margin) out.add(b.centre + b.rotation * (p - 0.5 * gap * n_b), gap, feature + index);
      return gap;
    };
    double least = margin;
    int deepest = -1;
    for (int k = 0; k < rim_points; ++k) {
      const CosSin& angle = rim_angles()[static_cast<std::size_t>(k)];
      const double gap = add(angle.c, angle.s, k);
      if (gap < least) least = gap, deepest = k;
    }
    if (deepest >= 0) {
      const double angle = deepest_angle(deepest, [&](double at) {
        const double gap = -way_out(b, centre + std::cos(at) * u + std::sin(at) * v, n_b);
        return std::isnan(gap) ? std::numeric_limits<double>::infinity() : gap;
      });
      add(std::cos(angle), std::sin(angle), rim_points + 3);
    }
    const double down_u = -u.dot(n_b), down_v = -v.dot(n_b), tilt = std::hypot(down_u, down_v);
    if (tilt > 1e-6 * a.radius) add(down_u / tilt, down_v / tilt, rim_points + 2);  // its deepest point
    // Where the rim meets the plane of the axis of b and the normal: the deepest against the side of b.
    const Vector3d w = b.rotation.transpose() * across;
    const double x = u.dot(w), y = v.dot(w), z = centre.dot(w), size = std::hypot(x, y);
    if (size < 1e-12 || std::abs(z) > size) continue;
    const double middle = std::atan2(y, x), off = std::acos(-z / size);
    add(std::cos(middle + off), std::sin(middle + off), rim_points);
    add(std::cos(middle - off), std::sin(middle - off), rim_points + 1);
  }
}

/// The place of least distance where it is neither a rim on a face nor a rim on a side: sides that cross, or rims.
void add_witness(const CylinderBody& a, const CylinderBody& b, const Vector3d& n, double gap, SurfaceGaps& out) {
  const Vector3d za = a.rotation.col(2), zb = b.rotation.col(2), between = a.centre - b.centre;
  const double na = n.dot(za), nb = n.dot(zb);
  const bool rim_a = std::abs(na) > 1e-3 && std::abs(na) < 1.0 - 1e-6;
  const bool rim_b = std::abs(nb) > 1e-3 && std::abs(nb) < 1.0 - 1e-6;
  if (rim_a && rim_b) {
    const Vector3d down = (-n + na * za).normalized(), up = (n - nb * zb).normalized();
    const Vector3d foot_a = a.centre + std::copysign(a.half, -na) * za + a.radius * down;
    const Vector3d foot_b = b.centre + std::copysign(b.half, nb) * zb + b.radius * up;
    out.add(0.5 * (foot_a + foot_b), gap, 0);
  }
  const double cosine = za.dot(zb), sine2 = 1.0 - cosine * cosine;
  if (std::abs(na) > 1e-2 || std::abs(nb) > 1e-2 || sine2 < 1e-4) return;
  const double along_a = between.dot(za), along_b = between.dot(zb);
  const double s = (cosine * along_b - along_a) / sine2, t = (along_b - cosine * along_a) / sine2;
  if (std::abs(s) > a.half || std::abs(t) > b.half) return;
  out.add(b.centre + t * zb + (b.radius + 0.5 * gap) * n, gap, 1);
}

}  // namespace

double CylinderBody::reach() const { return std::hypot(radius, half); }

double cylinder_distance(const Vector3d& p, double radius, double half, Vector3d& gradient) {
  const double rho = std::sqrt(p.x() * p.x() + p.y() * p.y());
  const double side = rho - radius, face = std::abs(p.z()) - half, sign = p.z() < 0.0 ? -1.0 : 1.0;
  if (side > 0.0 && face > 0.0) {
    const double distance = std::sqrt(side * side + face * face), scale = side / (distance * rho);
    gradient = {p.x() * scale, p.y() * scale, sign * face / distance};
    return distance;
  }
  if (side > face && rho > 0.0) {
    gradient = {p.x() / rho, p.y() / rho, 0.0};
    return side;
  }
  gradient = {0.0, 0.0, sign};
  return face;
}

ContactPatch cylinder_contacts(const CylinderBody& a, const CylinderBody& b, double margin) {
  const double reach = a.reach() + b.reach() + margin;
  if ((a.centre - b.centre).squaredNorm() > reach * reach) return {};
  double gap;
  const Vector3d n = widest_gap(a, b, margin, gap);
  if (gap > margin) return {};
  SurfaceGaps candidates;
  add_witness(a, b, n, gap, candidates);
  add_rims(a, b, n, margin, 2, candidates);
  add_rims(b, a, -n, margin, 2 + 2 * rim_candidates, candidates);
  return choose(candidates, n, b.radius);
}

ContactPatch plane_contacts(const CylinderBody& a, const PlaneBody& plane, double margin) {
  ContactPatch patch;
  const double height = plane.normal.dot(a.centre) - plane.offset;
  if (height > a.reach() + margin) return patch;
  const Vector3d axis = a.rotation.col(2);
  Vector3d down = -(plane.normal - plane.normal.dot(axis) * axis);
  // Upright, the deepest point of a rim would jump about: points fixed in the pellet serve as well.
  down = down.norm() > 0.05 ? down.normalized() : Vector3d(a.rotation.col(0));
  const Vector3d across = axis.cross(down);
  for (int end = 0; end < 2; ++end)
    for (int k = 0; k < 4; ++k) {
      const Vector3d radial = k == 0 ? down : k == 1 ? across : k == 2 ? Vector3d(-down) : Vector3d(-across);
      const Vector3d p = a.centre + (end == 0 ? -a.half : a.half) * axis + a.radius * radial;
      const double gap = plane.normal.dot(p) - plane.offset;
      if (gap < margin && patch.count < ContactPatch::capacity)
        patch.contacts[static_cast<std::size_t>(patch.count++)] = {p - 0.5 * gap * plane.normal, plane.normal, gap,
                                                                   end * 4 + k};
    }
  return patch;
}

}  // namespace kr5::sim
