// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/sim/bin_scan.hpp>
#include <kr5/sim/pellet_bin.hpp>

/// @file
/// What stands in a simulated work cell, and by how much it differs from what its controller is told.

namespace kr5::sim {

/// How one of the two grippers holds.
struct GripOptions {
  double reach = 0.0015;     ///< [m]
  double angle = 0.4363;     ///< [rad]
  double force = 6.0;        ///< [N]
  double torque = 0.018;     ///< [N m]
  double slip = 0.003;       ///< [m]
  double closing = 0.1;      ///< [s]
  double position = 1e-4;    ///< [m]
  double rotation = 1.5e-3;  ///< [rad]

  /// @throws InvalidArgument naming the field.
  void validate() const;
  static void each_field(auto& self, auto&& visit) {
    visit("reach", self.reach,
          "Distance of a pellet up to which it is taken: of its surface from the cup along Z of E, or of its axis from "
          "the middle between the fingers [m].");
    visit("angle", self.angle,
          "Angle up to which it is taken: of its surface from the cup, or of its axis from the plane between the "
          "fingers [rad].");
    visit("force", self.force, "Force at which a pellet begins to slip in the grip [N].");
    visit("torque", self.torque, "Torque at which a pellet begins to turn in the grip [N m].");
    visit("slip", self.slip, "Way that a pellet slips in the grip before it is lost [m].");
    visit("closing", self.closing, "Time from the command until the gripper holds, and tells that it does [s].");
    visit("position", self.position, "Standard deviation of the shift of a pellet as it is gripped, per axis [m].");
    visit("rotation", self.rotation, "Standard deviation of its rotation, per axis [rad].");
  }
};

/// A plate on which pellets are put down. Frame: origin in the middle of its upper face, Z up.
struct StandShape {
  Pose T_base_stand = Pose(Eigen::Translation3d(0.62, -0.08, 0.3));
  Eigen::Vector2d size = {0.12, 0.12};  ///< [m]

  /// @throws InvalidArgument naming the field.
  void validate() const;
  static void each_field(auto& self, auto&& visit) {
    visit("T_base_stand", self.T_base_stand, "Stand in the base: middle of its upper face, Z up [m].");
    visit("size", self.size, "Length of the plate along its X and Y [m].");
  }
};

/// Differences between the cell and what its controller is told; standard deviations are drawn once a cell.
struct WorkCellErrors {
  Eigen::Vector2d tube_offset = Eigen::Vector2d::Zero();  ///< [m]
  double tube_position = 0.0;                             ///< [m]
  double tube_tilt = 1.5e-3;                              ///< [rad]
  double face = 2e-4;                                     ///< [m]
  double stand_height = 1e-4;                             ///< [m]
  double bin_position = 3e-4;                             ///< [m]
  double stiffness = 0.1;                                 ///< [-]
  double servo = 0.0;                                     ///< [-]
  double friction = 0.0;                                  ///< [-]
  double pellet_radius = 0.0;                             ///< [m]
  double repeatability = 1e-4;                            ///< [m]
  double force_delay = 0.0;                               ///< [s]
  double force_gain = 0.0;                                ///< [-]
  double force_bias = 0.0;                                ///< [N]
  double force_drift = 0.0;                               ///< [N/s]

  /// @throws InvalidArgument naming the field.
  void validate() const;
  static void each_field(auto& self, auto&& visit) {
    visit("tube_offset", self.tube_offset, "Offset of every actual tube from where it is assumed, x and y of T [m].");
    visit("tube_position", self.tube_position,
          "Standard deviation of a further offset of each tube, x and y of T [m].");
    visit("tube_tilt", self.tube_tilt, "Standard deviation of the tilt of each tube, per axis [rad].");
    visit("face", self.face, "Standard deviation of the assumed height of the face of each tube [m].");
    visit("stand_height", self.stand_height, "Standard deviation of the assumed height of the stand [m].");
    visit("bin_position", self.bin_position, "Standard deviation of the assumed position of the bin, per axis [m].");
    visit("stiffness", self.stiffness, "Relative standard deviation of the stiffness of contact and grip [-].");
    visit("servo", self.servo,
          "Relative standard deviation of natural frequency and damping of the path servo from those of the cell [-].");
    visit("friction", self.friction,
          "Relative standard deviation of the friction of pellets from that of the cell [-].");
    visit("pellet_radius", self.pellet_radius, "Standard deviation of the radius of a pellet [m].");
    visit("repeatability", self.repeatability, "Repeatability of the arm, three standard deviations per axis [m].");
    visit("force_delay", self.force_delay, "Time by which readings of the force sensor are late [s].");
    visit("force_gain", self.force_gain,
          "Relative standard deviation of the scale of each component of the sensor [-].");
    visit("force_bias", self.force_bias,
          "Standard deviation of the offset of its forces; of its torques a tenth of a metre times that [N].");
    visit("force_drift", self.force_drift, "The same of the rate at which the offsets grow [N/s].");
  }
};

/// Beside the usual errors: servo and friction off by a third in the extreme, forces late by a cycle, of another scale,
/// offset and drifting, pellets within their tolerance.
WorkCellErrors severe_errors();

struct WorkCellOptions {
  BinShape bin = {.T_base_bin = Pose(Eigen::Translation3d(0.6, -0.32, 0.25))};
  PourOptions pour = {.pellets = 35};
  PileOptions pile;
  StandShape stand;
  std::vector<Pose> further_tubes;  ///< [m]
  double clearance = 2.8e-4;        ///< [m]
  double tube_depth = 0.0;          ///< [m]
  double table = 0.2;               ///< [m]
  GripOptions cup;
  GripOptions fingers = {.reach = 0.004, .angle = 0.3, .force = 60.0, .torque = 0.6, .slip = 0.006, .closing = 0.2};
  double finger_length = 0.012;      ///< [m]
  double lateral_stiffness = 0.0;    ///< [N/m]
  double angular_stiffness = 300.0;  ///< [N m/rad]
  double air = 10.0;                 ///< [N]
  BinScannerOptions scanner;
  WorkCellErrors errors;
  bool noise = true;
  std::uint64_t seed = 1;

  /// @throws InvalidArgument naming the field, with what holds it: `errors.face`.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("bin", self.bin, "Bin, where it is assumed.");
    visit("pour", self.pour, "Pellets that lie in it at the beginning.");
    visit("pile", self.pile, "Bodies and steps of the pile.");
    visit("stand", self.stand, "Stand, where it is assumed.");
    visit("further_tubes", self.further_tubes, "Assumed poses in the base of tubes beside that of the cell [m].");
    visit("clearance", self.clearance,
          "Clearance: radius of the bores minus nominal radius of the pellets; it sets the bores [m].");
    visit("tube_depth", self.tube_depth,
          "Depth of the bores, which may go down through the table; 0: that of the tube of the cell [m].");
    visit("table", self.table, "Height of the table in the base, on which a pellet is lost [m].");
    visit("cup", self.cup, "Suction cup, whose rim lies in the plane of E.");
    visit("fingers", self.fingers, "Two fingers, which close along Y of E.");
    visit("finger_length", self.finger_length, "Length of the fingers in front of E and behind it, along Z of E [m].");
    visit("lateral_stiffness", self.lateral_stiffness,
          "Stiffness of a grip across the pellet; 0: as contact.stiffness along it [N/m].");
    visit("angular_stiffness", self.angular_stiffness, "Stiffness of a grip against tilting [N m/rad].");
    visit("air", self.air, "Force of the compressed air on a pellet before the tool that is not held [N].");
    visit("scanner", self.scanner, "Line scanner for bin and stand.");
    visit("errors", self.errors, "Differences between the cell and what its controller is told.");
    visit("noise", self.noise, "Noise of sensors and arm, and random errors of grip and cell.");
    visit("seed", self.seed, "Random seed.");
  }
};

}  // namespace kr5::sim
