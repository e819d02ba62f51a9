// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include <kr5/cell/import_urdf.hpp>

#include "cell/urdf/model.hpp"

namespace kr5::cell {

/// A link that is moved by the arm, or by none of its joints.
struct CarriedLink {
  Pose T_base_link = Pose::Identity();  ///< When every joint value is zero.
  std::size_t carrier = 0;              ///< Number of the joint of the arm that moves it, from 1; 0: none.
};

/// The serial arm between two links of a robot.
struct ArmPath {
  std::string base, tip;
  std::vector<const UrdfJoint*> joints;      ///< That move, from the base.
  std::map<std::string, CarriedLink> links;  ///< All behind the base.
  std::set<std::string> chain;               ///< Links between base and tip.
  std::vector<std::string> held;             ///< Joints beside the arm.
  std::vector<std::string> ends;             ///< Links behind the tip, where several follow it and none was named.
  std::string tool;               ///< Link that stands for the force sensor or a payload; empty: there is none.
  std::set<std::string> of_tool;  ///< That link and all that it carries, which is the tool of a cell.
};

/// Links that stand for what hangs on the flange, where fixed joints connect them to the last moving link.
constexpr const char* sensor_link = "sensor";
constexpr const char* payload_link = "payload";

/// @throws IoError as import_urdf for an arm that cannot be found.
ArmPath find_arm_path(const UrdfModel& model, const UrdfOptions& options);

}  // namespace kr5::cell
