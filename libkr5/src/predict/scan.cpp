// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include <kr5/predict/sight.hpp>

#include "predict/real_arm.hpp"

namespace kr5::predict {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

struct Hit {
  double z = std::numeric_limits<double>::quiet_NaN();
  bool sphere = false;
};

/// First meeting of a ray with the sphere or the plane.
Hit meet(const cell::LaserTarget& target, const Ray& ray) {
  Hit hit;
  if (const double z = (target.plane - ray.origin.z()) / ray.direction.z(); z > 0 && std::isfinite(z)) hit.z = z;
  Solid ball{.kind = SolidKind::Ball};
  ball.radius = target.radius;
  const Meeting met = ball.meet({ray.origin - target.sphere, ray.direction});
  if (met.met() && !(met.distance >= hit.z)) hit = {met.distance, true};
  return hit;
}

}  // namespace

Shown scan(const cell::Cell& cell, const Given& given, const FlangeAt& flange) {
  given.need(cell.laser.has_value(), "laser");
  given.need(cell.laser->target.has_value(), "laser.target");
  const cell::SensorEffects& e = cell.effects.sensors;
  const Pose T_F_L = real_scanner_mount(cell);
  const auto x = given["x"], speed = given["speed"];
  Postures postures(given, flange);
  Eigen::VectorXd z(given.rows()), sphere(given.rows());
  for (Index k = 0; k < given.rows(); ++k) {
    const Pose T_B_L = postures.flange(k) * T_F_L;
    const Vector3d origin = T_B_L * Vector3d(x[k], -speed[k] * e.laser_lag, 0.0);
    const Hit hit = meet(*cell.laser->target, {origin, T_B_L.linear().col(2)});
    z[k] = biased_range(e, hit.z);
    sphere[k] = hit.sphere ? 1.0 : 0.0;
  }
  Shown out(given.rows());
  out.add("z", z);
  out.add("sphere", sphere);
  return out;
}

}  // namespace kr5::predict
