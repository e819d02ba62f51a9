// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <numbers>

#include <kr5/geometry/pose.hpp>
#include <kr5/sim/pellet_bin.hpp>
#include <kr5/sim/work_cell_options.hpp>

/// @file
/// How a suction cup meets a pellet, and whether it seals there.

namespace kr5::sim {

/// The rim of a cup on the surface of a pellet.
struct CupSeat {
  int pellet = -1;
  double distance = std::numeric_limits<double>::infinity();  ///< [m]
  double angle = std::numbers::pi;                            ///< [rad]

  bool within_reach(const GripOptions& cup) const { return distance <= cup.reach; }
  bool sealed(const GripOptions& cup) const { return within_reach(cup) && angle <= cup.angle; }

  static void each_field(auto& self, auto&& visit) {
    visit("pellet", self.pellet, "Number of the pellet in its scene, from 0; -1: none.");
    visit("distance", self.distance, "Distance of its surface from the middle of the rim [m].");
    visit("angle", self.angle, "Angle between the axis of the cup and the normal of the surface there [rad].");
  }
};

/// On one pellet, without a number. @param T_tool_pellet In the tool, whose origin is the middle of the rim, Z out of
/// the cup.
CupSeat cup_seat(const Pose& T_tool_pellet, double radius, double height);

/// On the pellet of a scene whose surface is nearest. @param T_bin_tool Tool in the bin.
CupSeat nearest_cup_seat(const PelletScene& scene, const Pose& T_bin_tool);

}  // namespace kr5::sim
