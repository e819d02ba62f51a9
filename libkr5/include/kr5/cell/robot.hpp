// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <kr5/core/error.hpp>
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
    visit("lower", self.lower, "Lower joint limits [rad or m].");
    visit("upper", self.upper, "Upper joint limits [rad or m].");
    visit("velocity", self.velocity, "Maximum joint speeds [rad/s or m/s].");
    visit("effort", self.effort, "Maximum joint torques [N m or N].");
  }
};

/// Gears between motors and links, used where an effect makes them elastic. The defaults are those of the format
/// `kr5-cell/1`, with which cells without this part are read.
struct Gears {
  /// Behind the free play of a backlash: one value a joint; the last holds for all further joints [N m/rad or N/m].
  std::vector<double> stiffness = {8e5, 8e5, 4e5, 8e4, 5e4, 3e4};
  double elastic_damping = 0.06;  ///< Ratio, of a joint_elasticity [-].
  double backlash_damping = 0.3;  ///< Ratio, of a backlash [-].
  double side_torque = 0.5;       ///< [N m or N]

  /// @throws InvalidArgument when there is no value at all.
  double stiffness_of(int joint) const {
    require(!stiffness.empty(), "robot.gears.stiffness: at least one value is needed [N m/rad or N/m]");
    return stiffness.at(std::min(static_cast<std::size_t>(joint), stiffness.size() - 1));
  }
  bool operator==(const Gears&) const = default;

  static void each_field(auto& self, auto&& visit) {
    visit("stiffness", self.stiffness,
          "Stiffness of each gear behind the free play of a backlash; the last value holds for further joints [N m/rad "
          "or N/m].");
    visit("elastic_damping", self.elastic_damping, "Damping ratio of the spring of a joint_elasticity [-].");
    visit("backlash_damping", self.backlash_damping, "Damping ratio of the gear of a backlash [-].");
    visit("side_torque", self.side_torque,
          "Load at rest above which a link lies at one end of its free play [N m or N].");
  }
};

/// The arm.
struct Robot {
  Pose T_base_0 = Pose::Identity();     ///< Frame of the first joint in the base.
  std::vector<kinematics::DhJoint> dh;  ///< One row a joint.
  /// Names of the joints in the robot's description and in its logs, from the base; empty when they have none.
  std::vector<std::string> joint_names;
  std::optional<Limits> limits;
  std::vector<Link> links;                      ///< One a joint, or none when masses are not known.
  Eigen::Vector3d gravity = {0.0, 0.0, -9.81};  ///< In B [m/s^2].
  Gears gears;

  int joints() const { return static_cast<int>(dh.size()); }

  static constexpr std::array<std::pair<std::string_view, std::string_view>, 1> file_keys = {{{"T_base_0", "T_B_0"}}};
  static constexpr std::array<std::string_view, 1> required = {"dh"};
  static void each_field(auto& self, auto&& visit) {
    visit("T_base_0", self.T_base_0, "Frame of the first joint in the base [m, rad].");
    visit("dh", self.dh, "Denavit-Hartenberg row of each joint.");
    visit("joint_names", self.joint_names,
          "Name of each joint in the robot's description and in its logs, from the base; empty when unnamed.");
    visit("limits", self.limits, "Limits of the joints.");
    visit("links", self.links, "Inertial parameters of each link, in link frame i; may be absent.");
    visit("gravity", self.gravity, "Gravity in B [m/s^2].");
    visit("gears", self.gears, "Gears; used where an effect makes them elastic.");
  }
};

}  // namespace kr5::cell
