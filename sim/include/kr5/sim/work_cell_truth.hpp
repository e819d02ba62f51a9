// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>

namespace kr5::sim {

/// Where a pellet of a work cell is.
enum class PelletPlace {
  Bin,
  Grip,   ///< In the cup or between the fingers.
  Loose,  ///< Let go, or lost from the grip, and not yet at rest.
  Stand,  ///< At rest on the stand.
  Tube,   ///< At rest in a tube, its lower end below the face.
  Lost,   ///< On the table, or at rest where nobody looks for it.
};
constexpr auto enum_names(PelletPlace) {
  using enum PelletPlace;
  return names<PelletPlace>(
      {{Bin, "bin"}, {Grip, "grip"}, {Loose, "loose"}, {Stand, "stand"}, {Tube, "tube"}, {Lost, "lost"}});
}

struct PelletTruth {
  PelletPlace place = PelletPlace::Bin;
  Pose T_base_pellet = Pose::Identity();
  double radius = 0.0;  ///< [m]
  double height = 0.0;  ///< [m]
  int tube = -1;
  double depth = 0.0;  ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("place", self.place, "Where it is: bin | grip | loose | stand | tube | lost.");
    visit("T_base_pellet", self.T_base_pellet, "Pellet in the base: origin in its middle, Z along its axis [m].");
    visit("radius", self.radius, "Radius [m].");
    visit("height", self.height, "Height [m].");
    visit("tube", self.tube,
          "Number of the tube in whose bore it is, from 0: its middle below the face, or its lower end, and its axis "
          "within the play of the bore; -1: in none.");
    visit("depth", self.depth, "Depth of its lower end below the face of that tube [m].");
  }
};

/// What is so in a work cell, whatever its sensors say.
struct WorkCellTruth {
  double time = 0.0;  ///< [s]
  Pose T_base_flange = Pose::Identity();
  Pose T_base_tool = Pose::Identity();
  Pose T_base_bin = Pose::Identity();
  Pose T_base_stand = Pose::Identity();
  std::vector<Pose> T_base_tubes;
  std::vector<PelletTruth> pellets;
  int gripped = -1;
  Pose T_tool_pellet = Pose::Identity();
  double slip = 0.0;                  ///< [m]
  Vector6 contact = Vector6::Zero();  ///< [N, N m]
  double max_force = 0.0;             ///< [N]

  static void each_field(auto& self, auto&& visit) {
    visit("time", self.time, "Time [s].");
    visit("T_base_flange", self.T_base_flange, "Flange in the base [m].");
    visit("T_base_tool", self.T_base_tool, "Tool tip in the base [m].");
    visit("T_base_bin", self.T_base_bin, "Bin in the base [m].");
    visit("T_base_stand", self.T_base_stand, "Stand in the base [m].");
    visit("T_base_tubes", self.T_base_tubes, "Tubes in the base: that of the cell, then further ones [m].");
    visit("pellets", self.pellets, "Pellets; each keeps its number.");
    visit("gripped", self.gripped, "Number of the pellet in the grip; -1: none.");
    visit("T_tool_pellet", self.T_tool_pellet, "Pellet in the tool, while one is gripped [m].");
    visit("slip", self.slip, "Way that it has slipped in the grip [m].");
    visit("contact", self.contact,
          "Wrench on the tool besides its own weight, about the origin of S in axes of B [N, N m].");
    visit("max_force", self.max_force, "Maximum force between gripper and pellet since the last grip [N].");
  }
};

}  // namespace kr5::sim
