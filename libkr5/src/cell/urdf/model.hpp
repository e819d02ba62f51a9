// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <kr5/geometry/pose.hpp>
#include <kr5/kinematics/body.hpp>

namespace kr5::cell {

struct UrdfJoint {
  std::string name, type, parent, child;
  Pose T_parent_child = Pose::Identity();           ///< At zero.
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< Of length 1, or zero where the file has no direction.
  std::string mimicked;                             ///< Joint whose value this one follows; empty: none.
  double mimic_multiplier = 1.0, mimic_offset = 0.0;
  double lower = 0.0, upper = 0.0, velocity = 0.0, effort = 0.0;  ///< Infinite where the file does not say.
  double damping = 0.0, friction = 0.0;

  bool moves() const { return type != "fixed"; }
};

/// What a URDF file says of bodies and joints.
struct UrdfModel {
  std::string source, name;
  std::map<std::string, kinematics::Body> links;
  std::vector<UrdfJoint> joints;  ///< In the order of the file.

  const UrdfJoint* parent_of(const std::string& link) const;
  std::vector<const UrdfJoint*> children_of(const std::string& link) const;
  [[noreturn]] void fail(const std::string& what) const;
};

/// @throws IoError for text that is no URDF.
UrdfModel read_urdf(std::string_view xml, const std::string& source);

}  // namespace kr5::cell
