// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <kr5/cell/cell.hpp>

/// @file
/// Cells from the Unified Robot Description Format (URDF). Read with pugixml, not urdfdom, which logs what is
/// wrong instead of naming file, element and remedy.

namespace kr5::cell {

struct UrdfOptions {
  std::string base = {};  ///< Link that becomes B; empty: the root.
  std::string tip = {};   ///< Link that becomes E; empty: the end of the only chain, before end frames and fingers.

  static void each_field(auto& self, auto&& visit) {
    visit("base", self.base, "Link that becomes the base B; by default the root of the tree.");
    visit("tip", self.tip,
          "Link that becomes the tool tip E; by default the end of the only chain, before end frames and fingers.");
  }
};

struct UrdfImport {
  /// `robot` with the names of its joints, a tool without mass when the tip lies beside the last joint axis, and drives
  /// when a joint has friction.
  Cell cell;
  std::string base;
  std::string tip;
  std::vector<std::string> joints;  ///< Names of the joints, from the base.
  std::vector<std::string> notes;   ///< What the cell cannot hold or the file did not say, in words.
};

/// The serial arm between two links of a robot. T_base_tool is the pose of the tip for the same joint values, and the
/// flange has the tip's axes. Links behind fixed joints, and behind joints beside the arm (held at 0, as a note
/// states), give their mass to the link that carries them. Limits that the file leaves out, sets to 0 or states without
/// a range become infinite, as a note states. `damping` and `friction` of the joints become viscous and Coulomb
/// friction of drives that are otherwise of unit gear and motor (a current is a joint torque), as a note states. Joint
/// axes less than 3 degrees from parallel get a Hayati angle. A link named `sensor`, or else `payload`, that fixed
/// joints connect to the last moving link is the tool of the cell with all that it carries, and its frame is that of
/// the force sensor.
/// @throws IoError naming file, link or joint, what was found and what to do: not a URDF, a xacro file, no such link,
/// an arm that branches and no tip, a joint of a kind that no cell has, an inertia on the arm that no body has.
UrdfImport import_urdf(const std::filesystem::path& file, const UrdfOptions& options = {});
UrdfImport parse_urdf(std::string_view xml, const std::string& source, const UrdfOptions& options = {});

}  // namespace kr5::cell
