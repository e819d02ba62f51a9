// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/force/peg_on_tube.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <kr5/core/error.hpp>

#include "force/contact/unit_roots.hpp"

namespace kr5::force {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// The peg seen from above: `d` points to the lowest point of its rim, `e` to the left of that. The rim is the ellipse
/// c + r cos(tilt) cos(b) d + r sin(b) e.
struct Plan {
  double sine = 0.0, cosine = 1.0;
  Eigen::Vector2d d, e, c;
  double along = 0.0, across = 0.0;  // c in d, e
};

Plan plan_of(double tilt, double alpha, const Eigen::Vector2d& centre) noexcept {
  Plan p;
  const double turn = tilt < 0 ? -1.0 : 1.0;  // a negative tilt leans to the other side
  p.sine = std::abs(std::sin(tilt));
  p.cosine = std::cos(tilt);
  p.d = turn * Eigen::Vector2d(std::cos(alpha), std::sin(alpha));
  p.e = Eigen::Vector2d(-p.d.y(), p.d.x());
  p.c = centre;
  p.along = p.d.dot(centre);
  p.across = p.e.dot(centre);
  return p;
}

PegRest flat(const PegTube& t, const Plan& p) noexcept {
  const double distance = p.c.norm();
  if (distance + t.peg_radius < t.inner_radius || distance - t.peg_radius > t.outer_radius) return {.height = nan};
  const Eigen::Vector2d away = distance > 0 ? Eigen::Vector2d(p.c / distance) : p.d;
  const Eigen::Vector2d nearest = away * std::clamp(distance, t.inner_radius, t.outer_radius);
  return {RestContact::Flat, 0.0, nearest, nearest};
}

PegRest on_face(const PegTube& t, const Plan& p, const Eigen::Vector2d& lowest) noexcept {
  PegRest rest{RestContact::RimOnFace, t.peg_radius * p.sine, lowest, lowest};
  rest.by_tilt = t.peg_radius * p.cosine;
  return rest;
}

PegRest on_outer_point(const PegTube& t, const Plan& p) noexcept {
  const Eigen::Vector2d point = t.outer_radius * p.d;
  const double slope = p.sine / p.cosine, reach = t.outer_radius - p.along;
  PegRest rest{RestContact::FaceOnOuterEdge, slope * reach, point, point};
  rest.by_centre = -slope * p.d;
  rest.by_alpha = -slope * p.across;
  rest.by_tilt = reach / (p.cosine * p.cosine);
  return rest;
}

/// The crossing of rim and circle nearest to the lowest point, which lies inside the bore (`side` 1) or outside the
/// tube
/// (`side` -1). Both ways round the rim are tried at once: the one towards c, or away from it, meets the circle first.
PegRest on_edge(const PegTube& t, const Plan& p, double R, double side) noexcept {
  const double r = t.peg_radius, minor = r * p.cosine, bulge = 0.5 * r * r * p.sine * p.sine;
  const double angle = first_angle(side * (p.c.squaredNorm() + r * r - R * R - bulge), side * 2 * minor * p.along,
                                   -side * bulge, 2 * r * std::abs(p.across), 0.0);
  if (std::isnan(angle)) return {.height = nan};
  const double way = (p.across < 0 ? -1.0 : 1.0) * side;
  const double cb = std::cos(angle), sb = way * std::sin(angle);
  PegRest rest{side > 0 ? RestContact::RimOnInnerEdge : RestContact::RimOnOuterEdge, r * p.sine * cb};
  rest.point = p.c + minor * cb * p.d + r * sb * p.e;
  rest.mirrored = p.across == 0 ? Eigen::Vector2d(p.c + minor * cb * p.d - r * sb * p.e) : rest.point;
  // The rim angle follows |point|^2 = R^2.
  const double by_angle = rest.point.dot(r * cb * p.e - minor * sb * p.d);
  const double drop = r * p.sine * sb / by_angle;
  rest.by_centre = drop * rest.point;
  rest.by_alpha = drop * rest.point.dot(minor * cb * p.e - r * sb * p.d);
  rest.by_tilt = r * p.cosine * cb - drop * rest.point.dot(p.d) * r * p.sine * cb;
  return rest;
}

bool valid(const PegTube& t) noexcept {
  return t.peg_radius > 0 && t.inner_radius >= 0 && t.outer_radius > t.inner_radius && std::isfinite(t.outer_radius) &&
         std::isfinite(t.peg_radius);
}

/// Of a tilt that is positive.
PegRest rest_tilted(const PegTube& t, const Plan& p) noexcept {
  const Eigen::Vector2d lowest = p.c + t.peg_radius * p.cosine * p.d;
  const double distance = lowest.norm();
  if (distance < t.inner_radius) return on_edge(t, p, t.inner_radius, 1);
  if (distance <= t.outer_radius) return on_face(t, p, lowest);
  const double x = (t.outer_radius - p.along) / p.cosine;  // the outermost point of the tube, seen in the peg's bottom
  if (x * x + p.across * p.across <= t.peg_radius * t.peg_radius) return on_outer_point(t, p);
  return on_edge(t, p, t.outer_radius, -1);
}

}  // namespace

void PegTube::validate() const {
  require(peg_radius > 0 && std::isfinite(peg_radius), "peg_radius must be positive [m]");
  require(inner_radius >= 0, "inner_radius must not be negative [m]");
  require(outer_radius > inner_radius && std::isfinite(outer_radius),
          "outer_radius must be greater than inner_radius [m]");
}

PegRest rest_peg_on_tube(const PegTube& t, double tilt, double alpha, const Eigen::Vector2d& centre) noexcept {
  if (!valid(t) || !(std::abs(tilt) < M_PI_2) || !std::isfinite(alpha) || !centre.allFinite()) return {.height = nan};
  const Plan p = plan_of(tilt, alpha, centre);
  if (p.sine == 0) return flat(t, p);
  PegRest rest = rest_tilted(t, p);
  if (tilt < 0) rest.by_tilt = -rest.by_tilt;
  return rest;
}

double resting_height(const PegTube& t, const Pose& T_tube_actual, double tilt, double alpha,
                      const Eigen::Vector2d& centre) noexcept {
  const Eigen::Vector3d axis =
      T_tube_actual.linear().transpose() *
      Eigen::Vector3d(std::sin(tilt) * std::cos(alpha), std::sin(tilt) * std::sin(alpha), std::cos(tilt));
  const double lean = std::atan2(axis.head<2>().norm(), axis.z());
  const double azimuth = lean > 0 ? std::atan2(axis.y(), axis.x()) : alpha;
  const Eigen::Vector3d start = T_tube_actual.inverse(Eigen::Isometry) * Eigen::Vector3d(centre.x(), centre.y(), 0);
  const Eigen::Vector3d up = T_tube_actual.linear().row(2);  // Z of T in the tube
  double height = 0;
  for (int i = 0; i < 50; ++i) {  // the slope of the height times the tube's small tilt is what an error shrinks by
    const Eigen::Vector3d at = start + height * up;
    const double step = (rest_peg_on_tube(t, lean, azimuth, at.head<2>()).height - at.z()) / up.z();
    height += step;
    if (up.head<2>().isZero(0) || !(std::abs(step) > 1e-13)) break;
  }
  return height;
}

void resting_heights(const PegTube& t, const Pose& T_tube_actual, std::span<const double> tilt,
                     std::span<const double> alpha, std::span<const double> cx, std::span<const double> cy,
                     std::span<double> height) {
  t.validate();
  const std::size_t n = tilt.size();
  require(alpha.size() == n && cx.size() == n && cy.size() == n && height.size() == n,
          "resting_heights: tilt has " + std::to_string(n) + " rows; alpha, cx, cy and height must have as many");
  for (std::size_t i = 0; i < n; ++i) height[i] = resting_height(t, T_tube_actual, tilt[i], alpha[i], {cx[i], cy[i]});
}

}  // namespace kr5::force
