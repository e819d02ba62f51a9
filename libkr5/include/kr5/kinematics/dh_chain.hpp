// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// Chains of revolute and prismatic joints in Denavit-Hartenberg parameters.

namespace kr5::kinematics {

enum class JointType { Revolute, Prismatic };
constexpr auto enum_names(JointType) {
  return names<JointType>({{JointType::Revolute, "revolute"}, {JointType::Prismatic, "prismatic"}});
}

/// One joint and the link behind it: T = Rz(theta) Tz(b) Tx(a) Rx(alpha) Ry(beta), with theta = theta_offset + q for a
/// revolute joint and b + q for a prismatic one (Hayat et al. 2022, eq. 3.34; beta after Hayati for near-parallel
/// axes).
struct DhJoint {
  JointType type = JointType::Revolute;
  double b = 0.0;             ///< [m]
  double theta_offset = 0.0;  ///< [rad]
  double a = 0.0;             ///< [m]
  double alpha = 0.0;         ///< [rad]
  double beta = 0.0;          ///< [rad]

  Pose transform(double q) const;

  static void each_field(auto& self, auto&& visit) {
    visit("type", self.type, "Type of the joint: revolute | prismatic.");
    visit("b", self.b, "Offset along the joint axis [m].");
    visit("theta_offset", self.theta_offset, "Offset of the joint angle [rad].");
    visit("a", self.a, "Length along the rotated x axis [m].");
    visit("alpha", self.alpha, "Twist about that x axis [rad].");
    visit("beta", self.beta, "Hayati's turn about y, for near-parallel axes [rad].");
  }
};

/// One row a sample.
using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// An open chain from the robot base B to the flange F.
struct DhChain {
  Pose T_base_0 = Pose::Identity();  ///< Frame of the first joint in the base.
  std::vector<DhJoint> joints;

  /// Poses of link frames 1..n in B; the last is the flange. `q` in joint units [rad or m].
  /// @throws InvalidArgument when q has not one value a joint.
  std::vector<Pose> link_poses(const Eigen::VectorXd& q) const;
  /// T_base_flange.
  Pose flange(const Eigen::VectorXd& q) const;
  /// T_base_flange of every row of q (N x n): N x 16, a row the 4 x 4 matrix row by row. Allocates only the result.
  Rows flanges(const Eigen::Ref<const Rows>& q) const;

  static void each_field(auto& self, auto&& visit) {
    visit("T_base_0", self.T_base_0, "Frame of the first joint in the base.");
    visit("joints", self.joints, "Joints, from the base.");
  }
};

}  // namespace kr5::kinematics
