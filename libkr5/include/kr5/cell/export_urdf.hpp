// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include <kr5/cell/cell.hpp>

/// @file
/// Cells to the Unified Robot Description Format (URDF).

namespace kr5::cell {

/// The arm and the mass of its tool as links base_link, link_1 ... link_n, flange, and sensor and tool_tip when there
/// is a tool, and the joint friction of the drives. Joints without names are joint_1 ... joint_n. `parse_urdf` gives
/// poses, torques, friction and names back, numbers to 1e-12; motors and gears, sensors, gravity and effects have no
/// place in a URDF.
/// @throws InvalidArgument when a prismatic joint has no limits, which a URDF requires.
std::string to_urdf(const Cell& cell);
void export_urdf(const Cell& cell, const std::filesystem::path& file);

}  // namespace kr5::cell
