// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/robot/command.hpp>

/// @file
/// The gripper of a work cell. How it takes, holds, loses and lets go is what WorkCell::World does with this state.

namespace kr5::sim {

/// What the gripper was told, and what it holds.
struct GripperState {
  robot::GripperCommand told = {.hold = false};
  double since = 0.0;  ///< [s]
  bool spent = false;  ///< It closed on nothing, or lost what it held.
  int pellet = -1;
  bool in_pile = false;  ///< The pellet still moves with the pile.
  bool rigid = true;     ///< It moves with the tool: nothing is near.
  double clear = 0.0;    ///< Time for which nothing was near [s].
  double slipped = 0.0;  ///< Before it was last taken as rigid [m].
  double force = 0.0;    ///< Maximum since the grip [N].
  double height = 0.0;   ///< Of the grip above the lower end of the pellet [m].
  Pose T_tool_pellet = Pose::Identity();
  Pose T_pellet_peg = Pose::Identity();  ///< Its lower end.
  Pose shift = Pose::Identity();         ///< Of the pellet once it has left the pile.

  static void each_field(auto& self, auto&& visit) {
    visit("told", self.told, "Last command.");
    visit("since", self.since, "Time of its last change [s].");
    visit("spent", self.spent, "Whether it closed on nothing, or lost what it held.");
    visit("pellet", self.pellet, "Number of the pellet in the grip; -1: none.");
    visit("in_pile", self.in_pile, "Whether that pellet still moves with the pile.");
    visit("rigid", self.rigid, "Whether it moves with the tool, for nothing is near.");
    visit("clear", self.clear, "Time for which nothing was near [s].");
    visit("slipped", self.slipped, "Way that it slipped before it was last taken as rigid [m].");
    visit("force", self.force, "Maximum force between gripper and pellet since the grip [N].");
    visit("height", self.height, "Height of the grip above the lower end of the pellet [m].");
    visit("T_tool_pellet", self.T_tool_pellet, "Pellet in the tool [m].");
    visit("T_pellet_peg", self.T_pellet_peg, "Its lower end in the pellet [m].");
    visit("shift", self.shift, "Shift of the pellet once it has left the pile [m].");
  }
};

}  // namespace kr5::sim
