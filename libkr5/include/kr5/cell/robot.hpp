// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/kinematics/body.hpp>
#include <kr5/kinematics/dh_chain.hpp>

namespace kr5::cell {

/// Mass of one link, in its frame.
using Link = kinematics::Body;

/// What the joints may do. Empty vectors: not known.
struct Limits {
  Eigen::VectorXd lower;     ///< [rad or m]
  Eigen::VectorXd upper;     ///< [rad or m]
  Eigen::VectorXd velocity;  ///< [rad/s or m/s]
  Eigen::VectorXd effort;    ///< [N m or N]

  static constexpr std::array<std::string_view, 2> required = {"lower", "upper"};
  static void each_field(auto& self, auto&& visit) {
    visit("lower", self.lower, "Least joint values [rad or m].");
    visit("upper", self.upper, "Greatest joint values [rad or m].");
    visit("velocity", self.velocity, "Greatest joint speeds [rad/s or m/s].");
    visit("effort", self.effort, "Greatest joint torques [N m or N].");
  }
};

/// The arm.
struct Robot {
  Pose T_B_0 = Pose::Identity();        ///< Frame of the first joint in the base.
  std::vector<kinematics::DhJoint> dh;  ///< One row a joint.
  std::optional<Limits> limits;
  std::vector<Link> links;                      ///< One a joint, or none when masses are not known.
  Eigen::Vector3d gravity = {0.0, 0.0, -9.81};  ///< In B [m/s^2].

  int joints() const { return static_cast<int>(dh.size()); }

  static constexpr std::array<std::string_view, 1> required = {"dh"};
  static void each_field(auto& self, auto&& visit) {
    visit("T_B_0", self.T_B_0, "Frame of the first joint in the base [m, rad].");
    visit("dh", self.dh, "Denavit-Hartenberg row of each joint.");
    visit("limits", self.limits, "What the joints may do.");
    visit("links", self.links, "Mass of each link, in link frame i; may be absent.");
    visit("gravity", self.gravity, "Gravity in B [m/s^2].");
  }
};

}  // namespace kr5::cell
