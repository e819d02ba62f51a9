// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/cell/import_urdf.hpp>

/// @file
/// A changed arm written into the URDF that describes it, which keeps its names, meshes and comments.

namespace kr5::cell {

struct UrdfUpdate {
  std::string xml;                   ///< The URDF with what changed.
  std::vector<std::string> changes;  ///< What changed, in words, in the order of the chain.
};

/// The document of a URDF with the arm of a cell in it: origins of joints where the geometry differs, `damping` and
/// `friction` where the drives differ, inertials where masses differ. Everything else keeps its text, limits included.
/// `parse_urdf` of the result, with the same base and tip, gives poses and torques of the cell to 1e-12 (in a simulator
/// that lumps fixed links, as all do). A changed mass goes to the link that the joint moves; where that would leave it
/// no mass, it takes over the masses of all that is fixed to it. A tip that is the last moving link and lies elsewhere
/// now becomes a link of its own, tool_tip; the mass of the tool goes to the link `sensor` or `payload`, added to the
/// tip where neither is there, so that a force sensor bears it. The effects of the cell are not read: fold them first.
/// @param cell Arm and tool; without links or drives the masses or the friction of the document stay.
/// @param options Base and tip, as at the import.
/// @throws IoError as parse_urdf, and for a URDF of another robot: joints of other names or another number, or an arm
/// of which a joint axis lies further off than a tenth of its reach or is turned by more than 0.2 rad.
UrdfUpdate update_urdf(std::string_view xml, const std::string& source, const Cell& cell,
                       const UrdfOptions& options = {});

}  // namespace kr5::cell
