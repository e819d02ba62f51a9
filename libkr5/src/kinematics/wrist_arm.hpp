// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>

#include <kr5/kinematics/dh_chain.hpp>

/// @file
/// A chain with a spherical wrist as six axes, where they lie when every joint is at zero.

namespace kr5::kinematics {

struct Axis {
  Eigen::Vector3d point, way;  ///< `way` is a unit vector.

  /// Where a turn about the axis takes a point.
  Eigen::Vector3d turned(double angle, const Eigen::Vector3d& p) const {
    return point + Eigen::AngleAxisd(angle, way) * (p - point);
  }
};

/// Lengths are in units of `size`, so that a tolerance is a plain number.
struct WristArm {
  std::array<Axis, 6> axes;
  Eigen::Vector3d wrist = Eigen::Vector3d::Zero();  ///< Where axes 4, 5 and 6 meet.
  Pose T_base_flange = Pose::Identity();            ///< With every joint at zero, in metres.
  double size = 1.0;                                ///< [m]

  struct Reach {
    Eigen::Vector3d wrist;
    Eigen::Matrix3d J;  ///< Its derivative by the first three joints.
  };
  Reach reach(const Eigen::Vector3d& q) const;
};

/// Nothing for a chain that has no spherical wrist, or whose wrist or first three joints lack a degree of freedom
/// everywhere.
std::optional<WristArm> wrist_arm(const DhChain& chain);

}  // namespace kr5::kinematics
