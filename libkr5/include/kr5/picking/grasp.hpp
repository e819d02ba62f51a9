// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/picking/bin.hpp>
#include <kr5/picking/clearance.hpp>
#include <kr5/picking/cloud.hpp>
#include <kr5/picking/pellets.hpp>

/// @file
/// Which cylinders of a pile a suction gripper can pick, how, and in which order (Hayat et al. 2022,
/// sections 2.3.2, 2.4 and 6.2).

namespace kr5::picking {

struct GraspOptions {
  double cup_radius = 0.004;
  std::vector<GripperPart> gripper = {{.radius = 0.005, .start = 0.001, .end = 0.15}};
  double clearance = 0.001;
  double neighbour_clearance = 0.0005;
  double min_exposed = 0.4;
  double min_sealed = 0.75;
  double max_lean = 0.9;
  double max_tilt = 0.2;
  double max_position_std = 0.001;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("cup_radius", self.cup_radius, "Radius of the suction cup [m].");
    visit("gripper", self.gripper,
          "Lengths of the gripper above the cup; the last is followed as far as above the rim.");
    visit("clearance", self.clearance, "Minimum distance of the gripper from the walls and the floor [m].");
    visit("neighbour_clearance", self.neighbour_clearance, "Minimum distance of the gripper from other points [m].");
    visit("min_exposed", self.min_exposed, "Minimum visible share of a cylinder to be picked [-].");
    visit("min_sealed", self.min_sealed, "Minimum measured share of the surface under the cup [-].");
    visit("max_lean", self.max_lean, "Maximum angle of the gripper from the vertical of the bin [rad].");
    visit("max_tilt", self.max_tilt, "Maximum angle of the gripper from the normal under the cup [rad].");
    visit("max_position_std", self.max_position_std,
          "Maximum standard deviation of the centre across the approach of a cylinder to be picked [m].");
  }
};

/// What keeps a cylinder from being picked.
enum class GraspFinding {
  Graspable,
  Hidden,       ///< Too little of it shows.
  Covered,      ///< Another one lies on it.
  SmallPatch,   ///< No place on it holds the cup.
  Leaning,      ///< Its free surface points too far sidewards.
  TouchesBin,   ///< The gripper would touch a wall or the floor.
  TouchesPile,  ///< The gripper would touch what lies beside it.
  Uncertain,    ///< Its place is not known well enough.
};
constexpr auto enum_names(GraspFinding) {
  return names<GraspFinding>({{GraspFinding::Graspable, "graspable"},
                              {GraspFinding::Hidden, "hidden"},
                              {GraspFinding::Covered, "covered"},
                              {GraspFinding::SmallPatch, "small_patch"},
                              {GraspFinding::Leaning, "leaning"},
                              {GraspFinding::TouchesBin, "touches_bin"},
                              {GraspFinding::TouchesPile, "touches_pile"},
                              {GraspFinding::Uncertain, "uncertain"}});
}

/// One cylinder of a plan.
struct Grasp {
  int pellet = 0;
  GraspFinding finding = GraspFinding::Hidden;
  std::string reason = "not judged";
  Pose T_base_gripper = Pose::Identity();
  bool on_face = false;
  double clearance = 0.0;
  double sealed = 0.0;
  std::vector<int> covered_by;
  int neighbours = 0;

  bool graspable() const { return finding == GraspFinding::Graspable; }

  static void each_field(auto& self, auto&& visit) {
    visit("pellet", self.pellet, "Number of the cylinder in the list given.");
    visit("finding", self.finding, "Whether it can be picked, or what keeps it from that.");
    visit("reason", self.reason, "Explanation in words.");
    visit("T_base_gripper", self.T_base_gripper,
          "Tip of the gripper on the surface, Z into it, X along the axis as far as that is square to Z.");
    visit("on_face", self.on_face, "Whether the cup sits on an end face.");
    visit("clearance", self.clearance, "Distance of the gripper from walls and floor along the whole approach [m].");
    visit("sealed", self.sealed, "Measured share of the surface under the cup [-].");
    visit("covered_by", self.covered_by, "Numbers of the cylinders that lie on it.");
    visit("neighbours", self.neighbours, "Number of cylinders that touch it, as far as they were found.");
  }
};

/// Judges every cylinder and orders them: first what can be picked, and of that first what nothing lies on, touches the
/// fewest others, and lies highest: what disturbs the others least. The approach is straight, along the axis of the
/// gripper; of the directions that clear walls and neighbours the one nearest to the vertical is taken.
/// @throws InvalidArgument for an invalid cloud, bin or options.
std::vector<Grasp> plan_picks(const std::vector<Pellet>& pellets, const Cloud& cloud, const Bin& bin,
                              const GraspOptions& options = {});

}  // namespace kr5::picking
