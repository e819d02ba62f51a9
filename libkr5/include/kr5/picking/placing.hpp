// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/geometry/uncertain_pose.hpp>
#include <kr5/picking/pellets.hpp>

/// @file
/// Placing of cylinders in a known orientation, on a grid, and from suction to two fingers (Hayat et al. 2022, sections
/// 2.4.2 and 6.3). The tool's Z points into the surface it approaches, its X along the axis of the cylinder when it
/// holds it by the side, and two fingers close along its Y. The pose of a cylinder has its origin in the centre and Z
/// along the axis; its turn about the axis means nothing. A seat is where a cylinder stands or lies: origin where it
/// touches, Z up, X along the axis of a lying one.

namespace kr5::picking {

/// Pose of a cylinder in the base, with the covariance of centre and tilts; the turn about the axis has none.
UncertainPose pellet_pose(const Pellet& pellet);

/// A cylinder in a gripper.
struct HeldPellet {
  UncertainPose T_tool_pellet;
  double radius = 0.0;
  double height = 0.0;

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("T_tool_pellet", self.T_tool_pellet, "Pose of the cylinder in the tool, with covariance.");
    visit("radius", self.radius, "Radius [m].");
    visit("height", self.height, "Height [m].");
  }
};

/// A cylinder that a tool at `T_base_tool` takes hold of. @param grip_covariance Of how far the cylinder moves in the
/// grip, in the frame of the cylinder [m, rad]. @throws InvalidArgument for a pose or covariance that is none.
HeldPellet hold(const Pellet& pellet, const Pose& T_base_tool, const Matrix6& grip_covariance = Matrix6::Zero());

enum class PelletPosture {
  Standing,  ///< On an end face.
  Lying,     ///< On the side.
};
constexpr auto enum_names(PelletPosture) {
  return names<PelletPosture>({{PelletPosture::Standing, "standing"}, {PelletPosture::Lying, "lying"}});
}

enum class GridOrder {
  Rows,     ///< Row by row.
  Columns,  ///< Column by column.
};
constexpr auto enum_names(GridOrder) {
  return names<GridOrder>({{GridOrder::Rows, "rows"}, {GridOrder::Columns, "columns"}});
}

/// A grid of seats on a tray, layer by layer. Cylinders of an upper layer stand on those below, or lie in the grooves
/// between them, so that such a layer has a row less.
struct StackOptions {
  PelletPosture posture = PelletPosture::Standing;
  int rows = 4;
  int columns = 5;
  int layers = 1;
  double radius = 0.008;
  double height = 0.017;
  double clearance = 0.002;
  GridOrder order = GridOrder::Rows;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("posture", self.posture, "Whether the cylinders stand or lie.");
    visit("rows", self.rows, "Number of rows, along Y of the tray.");
    visit("columns", self.columns, "Number of columns, along X of the tray.");
    visit("layers", self.layers, "Number of layers.");
    visit("radius", self.radius, "Maximum radius of the cylinders [m].");
    visit("height", self.height, "Maximum height of the cylinders [m].");
    visit("clearance", self.clearance, "Gap between neighbours of that size [m].");
    visit("order", self.order, "Order within a layer.");
  }
};

/// A seat of a stack.
struct StackSeat {
  int layer = 0;
  int row = 0;
  int column = 0;
  Pose T_base_seat = Pose::Identity();

  static void each_field(auto& self, auto&& visit) {
    visit("layer", self.layer, "Layer, from 0 at the bottom.");
    visit("row", self.row, "Row, from 0.");
    visit("column", self.column, "Column, from 0.");
    visit("T_base_seat", self.T_base_seat, "Pose of the seat.");
  }
};

/// The seats in the order to fill them, lowest layer first. @param T_base_tray Origin at the corner of the grid on the
/// surface, X along the columns, Y along the rows, Z up: the first seat is half a pitch from both edges.
/// @throws InvalidArgument for invalid options, or a pose that is no rigid motion.
std::vector<StackSeat> plan_stack(const Pose& T_base_tray, const StackOptions& options = {});

struct PlaceOptions {
  double release_gap = 0.0005;
  double retreat = 0.05;
  double max_tilt = 1.05;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("release_gap", self.release_gap, "Height above the seat at which the cylinder is let go [m].");
    visit("retreat", self.retreat, "Distance above the seat from which the tool comes and to which it leaves [m].");
    visit("max_tilt", self.max_tilt, "Maximum angle of the tool from straight down [rad].");
  }
};

/// How a held cylinder is placed.
struct Placement {
  bool possible = false;
  std::string message = "not run";
  Pose T_base_tool = Pose::Identity();
  Pose T_base_approach = Pose::Identity();
  UncertainPose T_base_pellet;
  double tilt = 0.0;

  static void each_field(auto& self, auto&& visit) {
    visit("possible", self.possible, "Whether the tool can place it so; if not, do not use the poses.");
    visit("message", self.message, "Explanation, with the remedy.");
    visit("T_base_tool", self.T_base_tool, "Pose of the tool at which the cylinder is let go.");
    visit("T_base_approach", self.T_base_approach, "Pose of the tool above that, from which it comes.");
    visit("T_base_pellet", self.T_base_pellet, "Pose that the cylinder will have when let go, with covariance.");
    visit("tilt", self.tilt, "Angle of the tool from straight down [rad].");
  }
};

/// Places a held cylinder on a seat, standing or lying. A cylinder may be turned about its axis and upside down: of all
/// poses of the tool that is taken which points straightest down, and among those the one whose X is nearest to that of
/// the seat. Not possible when it tilts too far, as when a cylinder that is held by its side shall stand:
/// `stand_up_steps` does that. @throws InvalidArgument for invalid arguments.
Placement place(const HeldPellet& held, const Pose& T_base_seat, PelletPosture posture,
                const PlaceOptions& options = {});

enum class Gripper {
  Suction,
  Fingers,
};
constexpr auto enum_names(Gripper) {
  return names<Gripper>({{Gripper::Suction, "suction"}, {Gripper::Fingers, "fingers"}});
}

enum class GripperAction {
  Keep,     ///< As it is.
  Release,  ///< Let go: suction off, fingers open.
  Grip,     ///< Take hold: suction on, fingers closed.
};
constexpr auto enum_names(GripperAction) {
  return names<GripperAction>(
      {{GripperAction::Keep, "keep"}, {GripperAction::Release, "release"}, {GripperAction::Grip, "grip"}});
}

/// A motion of one of the tools, straight to a pose, and what it does there.
struct HandlingStep {
  std::string name;
  Gripper gripper = Gripper::Suction;
  Pose T_base_tool = Pose::Identity();
  GripperAction action = GripperAction::Keep;
  UncertainPose T_base_pellet;

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "What the step is for.");
    visit("gripper", self.gripper, "Tool that moves.");
    visit("T_base_tool", self.T_base_tool, "Pose of that tool at the end of the step.");
    visit("action", self.action, "What the tool does there.");
    visit("T_base_pellet", self.T_base_pellet, "Pose of the cylinder then, with covariance.");
  }
};

struct RegripOptions {
  PlaceOptions placing = {};
  double lean = 0.7853981633974483;
  double lift = 0.05;
  Matrix6 grip_covariance = Matrix6::Zero();

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("placing", self.placing, "How the cylinder is put down.");
    visit("lean", self.lean,
          "Angle of the fingers from straight down where they take a lying cylinder that shall stand; they lean by the "
          "rest of a right angle where it stands [rad].");
    visit("lift", self.lift, "Height over the tray at which a cylinder is turned [m].");
    visit("grip_covariance", self.grip_covariance,
          "Covariance of how far a cylinder moves when the fingers close, in its frame [m, rad].");
  }
};

/// Steps of a sequence, or why there are none.
struct HandlingPlan {
  bool possible = false;
  std::string message = "not run";
  std::vector<HandlingStep> steps;

  static void each_field(auto& self, auto&& visit) {
    visit("possible", self.possible, "Whether the tools can do it.");
    visit("message", self.message, "Explanation, with the remedy.");
    visit("steps", self.steps, "Motions in their order; empty when not possible.");
  }
};

/// From suction to two fingers: puts a cylinder down on a seat and takes it there with the fingers, straight from
/// above, a lying one with X along its axis. @throws InvalidArgument for invalid arguments.
HandlingPlan regrip_steps(const HeldPellet& held, const Pose& T_base_seat, PelletPosture posture,
                          const RegripOptions& options = {});

/// Makes a cylinder stand that the suction gripper holds by its side: puts it down lying, takes it with leaning
/// fingers, turns it by a right angle over the tray, puts it down standing and takes it from above.
/// @throws InvalidArgument for invalid arguments.
HandlingPlan stand_up_steps(const HeldPellet& held, const Pose& T_base_lying_seat, const Pose& T_base_standing_seat,
                            const RegripOptions& options = {});

}  // namespace kr5::picking
