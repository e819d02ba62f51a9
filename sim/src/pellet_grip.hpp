// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include <kr5/geometry/pose.hpp>
#include <kr5/sim/work_cell_options.hpp>

/// @file
/// Which pellet a closing gripper takes, and how it then lies in it: geometry alone.

namespace kr5::sim {

/// A pellet that is taken.
struct PelletTaken {
  double distance = 0.0;                  ///< From the middle of the gripper [m].
  Pose T_tool_pellet = Pose::Identity();  ///< Once the gripper has closed [m].
};

/// By the cup, when its rim meets the surface of the pellet squarely; it stays as it lies.
std::optional<PelletTaken> taken_by_cup(const Pose& T_tool_pellet, double radius, double height,
                                        const GripOptions& cup);
/// Between two fingers that close along Y of E on the side of the pellet: its axis comes to lie in their middle plane.
/// @param length Of the fingers in front of E and behind it [m].
std::optional<PelletTaken> taken_by_fingers(const Pose& T_tool_pellet, double radius, double height,
                                            const GripOptions& fingers, double length);

/// The pellet as a peg that points away from the tool: bottom centre, Z along the axis towards the tool.
Pose T_pellet_peg(const Pose& T_tool_pellet, double height);

}  // namespace kr5::sim
