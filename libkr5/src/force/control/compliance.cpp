// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/force/compliance.hpp>

#include <cmath>
#include <limits>

#include <kr5/core/error.hpp>

namespace kr5::force {
namespace {

Eigen::Vector3d at_most(const Eigen::Vector3d& v, double most) noexcept {
  const double size = v.norm();
  if (!(size < std::numeric_limits<double>::infinity())) return Eigen::Vector3d::Zero();
  return size > most ? Eigen::Vector3d(v * (most / size)) : v;
}

}  // namespace

bool ComplianceOptions::stable(double stiffness, double turning_stiffness, double delay) const {
  return gain * stiffness * delay <= 1 && turning_gain * turning_stiffness * delay <= 1;
}

void ComplianceOptions::validate() const {
  require(gain >= 0 && std::isfinite(gain), "gain must not be negative [m/(s N)]");
  require(turning_gain >= 0 && std::isfinite(turning_gain), "turning_gain must not be negative [rad/(s N m)]");
  require(max_speed > 0 && max_speed <= 10, "max_speed must lie between 0 and 10 m/s");
  require(max_turning_speed > 0 && max_turning_speed <= 100, "max_turning_speed must lie between 0 and 100 rad/s");
}

Vector6 admittance_twist(const Vector6& wrench, const Vector6& reference, const ComplianceOptions& options) noexcept {
  const Vector6 error = wrench - reference;
  if (!error.allFinite()) return Vector6::Zero();
  Vector6 out;
  out << at_most(options.gain * error.head<3>(), options.max_speed),
      at_most(options.turning_gain * error.tail<3>(), options.max_turning_speed);
  return out;
}

}  // namespace kr5::force
