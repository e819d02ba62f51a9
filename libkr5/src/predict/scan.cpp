// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include "predict/real_arm.hpp"

namespace kr5::predict {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

constexpr double best_distance = 0.19;  ///< Where the scanner has no bias [m].
constexpr double bias_distance = 0.05;  ///< As far from there the bias is what is stated [m].

struct Hit {
  double z = std::numeric_limits<double>::quiet_NaN();
  bool sphere = false;
};

/// First meeting of a ray with the sphere or the plane.
Hit meet(const cell::LaserTarget& target, const Vector3d& origin, const Vector3d& ray) {
  Hit hit;
  if (const double z = (target.plane - origin.z()) / ray.z(); z > 0 && std::isfinite(z)) hit.z = z;
  const Vector3d m = origin - target.sphere;
  const double along = ray.dot(m), inside = along * along - m.squaredNorm() + target.radius * target.radius;
  if (inside <= 0) return hit;
  const double z = -along - std::sqrt(inside);
  if (z > 0 && !(z >= hit.z)) hit = {z, true};
  return hit;
}

Pose real_mount(const cell::Cell& cell, const Given& given) {
  const auto& moved = cell.effects.sensors.T_E_L;
  if (moved) return (cell.tool ? cell.tool->T_F_E : Pose::Identity()) * *moved;
  const std::optional<Pose> T_F_L = cell::T_F_L(cell);
  given.need(T_F_L.has_value(), "laser.T_E_L");
  return *T_F_L;
}

}  // namespace

Shown scan(const cell::Cell& cell, const Given& given, const FlangeAt& flange) {
  given.need(cell.laser.has_value(), "laser");
  given.need(cell.laser->target.has_value(), "laser.target");
  const cell::SensorEffects& e = cell.effects.sensors;
  const Pose T_F_L = real_mount(cell, given);
  const auto x = given["x"], speed = given["speed"];
  Postures postures(given, flange);
  Eigen::VectorXd z(given.rows()), sphere(given.rows());
  for (Index k = 0; k < given.rows(); ++k) {
    const Pose T_B_L = postures.flange(k) * T_F_L;
    const Vector3d origin = T_B_L * Vector3d(x[k], -speed[k] * e.laser_lag, 0.0);
    const Hit hit = meet(*cell.laser->target, origin, T_B_L.linear().col(2));
    const double off = (hit.z - best_distance) / bias_distance;
    z[k] = hit.z + e.laser_bias * off * off;
    sphere[k] = hit.sphere ? 1.0 : 0.0;
  }
  Shown out(given.rows());
  out.add("z", z);
  out.add("sphere", sphere);
  return out;
}

}  // namespace kr5::predict
