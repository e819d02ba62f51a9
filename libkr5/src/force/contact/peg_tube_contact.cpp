// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/force/peg_tube_contact.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <kr5/core/error.hpp>

#include "force/contact/round_body.hpp"

namespace kr5::force {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int samples = 48;  // of an edge; every second one may become a contact
constexpr double step = 2 * M_PI / samples;
constexpr double tilt_all_samples = 1.0 * M_PI / 180, tilt_no_samples = 2.6 * M_PI / 180;
constexpr double level = 1e-12;  // [m] less is rounding: an upright peg is as deep everywhere
constexpr int no_face = -1;

Body peg_body(const PegTubeShape& s, const Pose& T) noexcept {
  Body peg;
  peg.origin = T.translation();
  peg.axis = T.linear().col(2);
  const double lean = peg.axis.head<2>().norm();
  // `u` points to the lowest point of the rim, so that samples lie alike on both sides of it.
  const Vector3d low = lean > 1e-12 ? Vector3d(peg.axis.x() / lean, peg.axis.y() / lean, 0) : T.linear().col(0);
  peg.v = peg.axis.cross(low).normalized();
  peg.u = peg.v.cross(peg.axis);
  const int bottom = peg.add_face(0, -1, 0), side = peg.add_face(1, 0, s.peg_radius);
  peg.add_face(0, 1, s.peg_length);
  if (s.peg_chamfer > 0) {
    const int cone = peg.add_face(M_SQRT1_2, -M_SQRT1_2, M_SQRT1_2 * (s.peg_radius - s.peg_chamfer));
    peg.add_edge({s.peg_radius - s.peg_chamfer, 0, bottom, cone});
    peg.add_edge({s.peg_radius, s.peg_chamfer, cone, side});
  } else {
    peg.add_edge({s.peg_radius, 0, bottom, side});
  }
  return peg;
}

Body tube_body(const PegTubeShape& s, const Body& peg) noexcept {
  Body tube;
  tube.u = Vector3d(peg.u.x(), peg.u.y(), 0).normalized();
  tube.v = tube.axis.cross(tube.u);
  const int top = tube.add_face(0, 1, 0), bore = tube.add_face(-1, 0, -s.inner_radius);
  const int outside = tube.add_face(1, 0, s.outer_radius);
  tube.add_face(0, -1, s.tube_depth);
  if (s.tube_chamfer > 0) {
    const int cone = tube.add_face(-M_SQRT1_2, M_SQRT1_2, -M_SQRT1_2 * (s.inner_radius + s.tube_chamfer));
    tube.add_edge({s.inner_radius + s.tube_chamfer, 0, top, cone});
    tube.add_edge({s.inner_radius, -s.tube_chamfer, cone, bore});
  } else {
    tube.add_edge({s.inner_radius, 0, top, bore});
  }
  tube.add_edge({s.outer_radius, 0, top, outside});
  return tube;
}

/// The face on whose side `normal` lies outside the cone of an edge; none inside, where it is a sum of the two faces'
/// normals at `point` with weights that are not negative.
int face_beyond(const Body& body, const Edge& e, const Vector3d& point, const Vector3d& normal) noexcept {
  const Vector3d a = body.face_normal(e.first, point), b = body.face_normal(e.second, point);
  const double c = a.dot(b), x = normal.dot(a), y = normal.dot(b);
  if (x - c * y < -1e-9) return e.second;
  return y - c * x < -1e-9 ? e.first : no_face;
}

bool in_cone(const Body& body, const Edge& e, const Vector3d& point, const Vector3d& normal) noexcept {
  return face_beyond(body, e, point, normal) == no_face;
}

/// The edge at which two faces of a body meet, null when they do not.
const Edge* edge_of(const Body& body, int a, int b) noexcept {
  for (int i = 0; i < body.edge_count; ++i) {
    const Edge& e = body.edges[static_cast<std::size_t>(i)];
    if ((e.first == a && e.second == b) || (e.first == b && e.second == a)) return &e;
  }
  return nullptr;
}

/// Deepest point of one edge of a body near an angle.
struct Peak {
  double angle = 0.0;
  Depth depth;
  int other = no_face;  ///< The face that takes over at a kink.
};

/// Cosines and sines of the samples.
struct Angles {
  std::array<double, samples> cosine, sine;
  Angles() {
    for (int i = 0; i < samples; ++i) {
      cosine[static_cast<std::size_t>(i)] = std::cos(i * step);
      sine[static_cast<std::size_t>(i)] = std::sin(i * step);
    }
  }
};
const Angles angles;

/// Golden section in t = tan of half the angle from sample `k`; gives up once the peak cannot reach the other body.
Peak refine(const Track& track, double radius, int k) noexcept {
  constexpr double golden = std::numbers::phi - 1;
  const double c = angles.cosine[static_cast<std::size_t>(k)], s = angles.sine[static_cast<std::size_t>(k)];
  const auto depth = [&](double t) {
    const double scale = 1 / (1 + t * t), ct = (1 - t * t) * scale, st = 2 * t * scale;
    return track.at(c * ct - s * st, s * ct + c * st);
  };
  double high = std::tan(0.5 * step), low = -high;
  double a = high - golden * (high - low), b = low + golden * (high - low);
  double at_a = depth(a).value, at_b = depth(b).value;
  while (high - low > 1e-8 && std::max(at_a, at_b) > 2 * radius * (low - high)) {
    if (at_a > at_b) {
      high = b, b = a, at_b = at_a;
      a = high - golden * (high - low), at_a = depth(a).value;
    } else {
      low = a, a = b, at_a = at_b;
      b = low + golden * (high - low), at_b = depth(b).value;
    }
  }
  const double t = 0.5 * (low + high);
  Peak peak{k * step + 2 * std::atan(t), depth(t), no_face};
  const int before = depth(t - 1e-6).face, after = depth(t + 1e-6).face;
  if (before != after) peak.other = peak.depth.face == before ? after : before;
  return peak;
}

/// Common perpendicular of an edge of the peg and one of the tube, out of the tube.
struct Crossing {
  Vector3d on_peg, on_tube, normal;

  double depth() const noexcept { return normal.dot(on_tube - on_peg); }
};

double angle_at(const Body& body, const Vector3d& point) noexcept {
  return std::atan2(body.v.dot(point - body.origin), body.u.dot(point - body.origin));
}

/// From a point near both edges; nothing when they are parallel.
std::optional<Crossing> crossing(const Body& peg, const Edge& rim, const Body& tube, const Edge& edge,
                                 const Vector3d& start) noexcept {
  double angle = angle_at(peg, start), other = angle_at(tube, start);
  Vector3d p, q, t, s;
  for (int i = 0; i < 8; ++i) {
    p = peg.edge_point(rim, angle), q = tube.edge_point(edge, other);
    t = peg.tangent(angle), s = tube.tangent(other);
    const double c = t.dot(s), alone = 1 - c * c;
    if (!(alone > 1e-12)) return {};
    const Vector3d gap = q - p;
    const double along = (t.dot(gap) - c * s.dot(gap)) / alone, across = (c * t.dot(gap) - s.dot(gap)) / alone;
    angle += std::clamp(along / rim.radius, -step, step);
    other += std::clamp(across / edge.radius, -step, step);
    if (std::abs(along) + std::abs(across) < 1e-12) break;
  }
  Vector3d normal = t.cross(s).normalized();
  if (normal.dot(tube.face_normal(edge.first, q) + tube.face_normal(edge.second, q)) < 0) normal = -normal;
  return Crossing{p, q, normal};
}

/// Searches the edges of one body in the other.
struct Search {
  const Body& peg;
  const Body& tube;
  double sample_weight = 0.0;
  Contacts& found;
  ContactPoint spare;  ///< Deepest point in case that none is a contact by the rules.

  void run(const Body& owner, const Edge& e, const Body& in) noexcept {
    const Track track(owner, e, in);
    std::array<double, samples> depth;
    for (std::size_t i = 0; i < samples; ++i) {
      depth[i] = track.at(angles.cosine[i], angles.sine[i]).value;
      if (i % 2 == 0 && depth[i] > 0 && sample_weight > 0) add_sample(owner, e, in, static_cast<int>(i), depth[i]);
    }
    const double rise = e.radius * step;  // depth changes by no more than the way: peaks are not higher above samples
    for (int i = 0; i < samples; ++i) {
      const auto at = [&](int k) { return depth[static_cast<std::size_t>((k + samples) % samples)]; };
      const bool falls = at(i) - at(i + 1) > level;
      const bool pair = std::abs(at(i) - at(i + 1)) <= level && at(i + 1) - at(i + 2) > level;
      if (at(i) > -rise && at(i) - at(i - 1) > level && (falls || pair))
        judge(owner, e, in, refine(track, e.radius, i));
    }
  }

  void add_sample(const Body& owner, const Edge& e, const Body& in, int k, double depth) noexcept {
    const Vector3d point = owner.edge_point(e, k * step);
    found.add({point, smooth_normal(in, point), depth, sample_weight, ContactFeature::Sample});
  }

  /// Beside an edge the nearest face changes; this normal turns from one face's to the other's instead.
  Vector3d smooth_normal(const Body& in, const Vector3d& point) const noexcept {
    const Vector3d d = point - in.origin, out = in.outward(point);
    Vector2d sum = Vector2d::Zero();
    for (int i = 0; i < in.face_count; ++i) {
      const Face& f = in.faces[static_cast<std::size_t>(i)];
      const double depth = f.offset - f.normal.x() * out.dot(d) - f.normal.y() * in.axis.dot(d);
      sum += f.normal / (depth * depth);
    }
    const Vector3d n = (sum.x() * out + sum.y() * in.axis).normalized();
    return &in == &tube ? n : Vector3d(-n);
  }

  Vector3d normal_at(const Body& in, int face, const Vector3d& point) const noexcept {
    const Vector3d n = in.face_normal(face, point);
    return &in == &tube ? n : Vector3d(-n);
  }

  void judge(const Body& owner, const Edge& e, const Body& in, const Peak& peak) noexcept {
    if (!(peak.depth.value > 0)) return;
    const Vector3d point = owner.edge_point(e, peak.angle);
    ContactPoint contact{point, normal_at(in, peak.depth.face, point), peak.depth.value, 1.0,
                         &owner == &peg ? ContactFeature::RimOnFace : ContactFeature::EdgeOnPeg};
    if (contact.depth > spare.depth) spare = contact;
    if (const Edge* crossed = peak.other == no_face ? nullptr : edge_of(in, peak.depth.face, peak.other)) {
      const int face = cross(&owner == &peg, e, *crossed, point);
      if (face == no_face) return;
      contact.normal = normal_at(in, face, point);
    }
    const Vector3d own = &owner == &peg ? Vector3d(-contact.normal) : contact.normal;
    if (in_cone(owner, e, point, own)) found.add(contact);
  }

  /// Contact of an edge with one of the other body that it crosses. Where their perpendicular has left the cone of the
  /// latter, the edge touches a face: the crossing lies beside the peak by about the depth, so that close to where one
  /// hands over to the other the peak still is at the kink. @returns That face.
  int cross(bool from_peg, const Edge& e, const Edge& crossed, const Vector3d& point) noexcept {
    const Edge &rim = from_peg ? e : crossed, &edge = from_peg ? crossed : e;
    const auto both = crossing(peg, rim, tube, edge, point);
    if (!both) return no_face;
    const int on_tube = face_beyond(tube, edge, both->on_tube, both->normal);
    const int on_peg = face_beyond(peg, rim, both->on_peg, -both->normal);
    if (from_peg && on_tube == no_face && on_peg == no_face && both->depth() > 0)
      found.add({0.5 * (both->on_peg + both->on_tube), both->normal, both->depth(), 1.0, ContactFeature::EdgeEdge});
    return from_peg ? on_tube : on_peg;
  }
};

double sample_weight(const Body& peg) noexcept {
  const double tilt = std::atan2(peg.axis.head<2>().norm(), peg.axis.z());
  const double x = std::clamp((tilt_no_samples - tilt) / (tilt_no_samples - tilt_all_samples), 0.0, 1.0);
  return x * x * (3 - 2 * x);
}

}  // namespace

void PegTubeShape::validate() const {
  require(peg_radius > 0, "peg_radius must be positive [m]");
  require(peg_length > 0, "peg_length must be positive [m]");
  require(peg_chamfer >= 0 && peg_chamfer < std::min(peg_radius, peg_length),
          "peg_chamfer must lie between 0 and the peg's radius and length [m]");
  require(inner_radius > 0, "inner_radius must be positive [m]");
  require(outer_radius > inner_radius, "outer_radius must be greater than inner_radius [m]");
  require(tube_depth > 0, "tube_depth must be positive [m]");
  require(tube_chamfer >= 0 && tube_chamfer < std::min(outer_radius - inner_radius, tube_depth),
          "tube_chamfer must lie between 0 and the tube's wall and depth [m]");
}

double Contacts::depth() const noexcept {
  double most = 0;
  for (const ContactPoint& c : *this) most = std::max(most, c.depth);
  return most;
}

Contacts peg_tube_contacts(const PegTubeShape& shape, const Pose& T_tube_peg) noexcept {
  Contacts found;
  const Body peg = peg_body(shape, T_tube_peg), tube = tube_body(shape, peg);
  Search search{peg, tube, sample_weight(peg), found, {}};
  for (int i = 0; i < peg.edge_count; ++i) search.run(peg, peg.edges[static_cast<std::size_t>(i)], tube);
  for (int i = 0; i < tube.edge_count; ++i) search.run(tube, tube.edges[static_cast<std::size_t>(i)], peg);
  if (found.count == 0 && search.spare.depth > 0) found.add(search.spare);
  return found;
}

Contacts peg_bench_contacts(const PegTubeShape& shape, const Pose& T_tube_peg) noexcept {
  Contacts found;
  const Body peg = peg_body(shape, T_tube_peg);
  const double weight = sample_weight(peg);
  for (int k = 0; k < peg.edge_count; ++k) {
    const Edge& e = peg.edges[static_cast<std::size_t>(k)];
    for (int i = 0; i < samples; i += 2) {  // the first one is the lowest
      const Vector3d point = peg.edge_point(e, i * step);
      if (point.z() < 0 && (i == 0 || weight > 0))
        found.add({point, Vector3d::UnitZ(), -point.z(), i == 0 ? 1.0 : weight,
                   i == 0 ? ContactFeature::RimOnFace : ContactFeature::Sample});
    }
  }
  return found;
}

}  // namespace kr5::force
