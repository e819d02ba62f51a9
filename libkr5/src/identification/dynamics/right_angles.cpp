// SPDX-License-Identifier: BSD-3-Clause
#include "identification/dynamics/right_angles.hpp"

#include <cmath>
#include <numbers>

namespace kr5::identification {
namespace {

constexpr double quarter = std::numbers::pi / 2;
constexpr double four_digits = 1e-4;  // [rad] more than four or more digits leave of a few right angles
constexpr double no_length = 1e-4;    // over the reach

/// What rounding to so many digits leaves of a right angle, or of several [rad].
double rounding_of(int quarters, double digit) {
  return std::abs(quarters * quarter - std::round(quarters * quarter / digit) * digit);
}

/// Whether a tilt is what rounding leaves of right angles. A tilt of the size that 1.57 leaves may be real: it must be
/// just that.
bool is_rounding(double tilt) {
  constexpr double same = 1e-6;  // [rad]
  if (std::abs(tilt) < four_digits) return true;
  for (const double digit : {1e-2, 1e-3})
    for (int quarters = 1; quarters <= 4; ++quarters)
      if (std::abs(std::abs(tilt) - rounding_of(quarters, digit)) < same) return true;
  return false;
}

double right_angle(double angle) {
  const double turns = std::round(angle / quarter) * quarter;
  return is_rounding(angle - turns) ? turns : angle;
}

}  // namespace

ArmInGravity with_right_angles(const kinematics::DhChain& chain, const Eigen::Vector3d& gravity) {
  ArmInGravity out{chain, chain.T_base_0.linear().transpose() * gravity};
  out.chain.T_base_0 = Pose::Identity();
  const double size = gravity.norm();
  for (double& g : out.gravity)
    if (std::abs(g) < size / 2 && is_rounding(std::asin(g / size))) g = 0.0;
  if (size > 0) out.gravity *= size / out.gravity.norm();
  double reach = 0.0;
  for (const kinematics::DhJoint& row : chain.joints) reach += std::abs(row.a) + std::abs(row.b);
  for (kinematics::DhJoint& row : out.chain.joints) {
    row.alpha = right_angle(row.alpha);
    row.beta = right_angle(row.beta);
    row.theta_offset = right_angle(row.theta_offset);
    if (std::abs(row.a) < no_length * reach) row.a = 0.0;
    if (std::abs(row.b) < no_length * reach) row.b = 0.0;
  }
  return out;
}

}  // namespace kr5::identification
