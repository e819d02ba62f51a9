// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <kr5/core/random.hpp>
#include <kr5/sim/work_cell.hpp>

#include "cell_solids.hpp"
#include "commanded_arm.hpp"
#include "held_peg.hpp"
#include "pellet_grip.hpp"
#include "pile_dynamics.hpp"
#include "work_cell_grip.hpp"

namespace kr5::sim {

/// A pellet that was let go and has not come to rest.
struct LoosePellet {
  int number = 0;
  Pose T_pellet_peg = Pose::Identity();
  double quiet = 0.0;  ///< [s]
  Pose T_base_quiet = Pose::Identity();
  HeldPegState motion;

  static void each_field(auto& self, auto&& visit) {
    visit("number", self.number, "Number of the pellet.");
    visit("T_pellet_peg", self.T_pellet_peg, "Its lower end in the pellet [m].");
    visit("quiet", self.quiet, "Time for which it has stayed where it is [s].");
    visit("T_base_quiet", self.T_base_quiet, "Where it has stayed [m].");
    visit("motion", self.motion, "Motion.");
  }
};

/// All of a work cell that changes.
struct WorkCellRecord {
  std::string random;
  CommandedArmState arm;
  PileMotion pile;
  std::vector<int> pile_numbers;
  double disturbed = 0.0;  ///< [s]
  double pile_due = 0.0;   ///< [s]
  std::vector<PelletTruth> pellets;
  GripperState gripper;
  HeldPegState peg;
  Pose T_base_tool = Pose::Identity();
  Vector6 velocity = Vector6::Zero();  ///< [m/s, rad/s]
  std::vector<LoosePellet> loose;
  bool scanning = false;
  int scans = 0, profiles = 0;
  std::vector<double> scan_times;          ///< [s]
  std::vector<Pose> scan_real, scan_told;  ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("random", self.random, "Random numbers of grips.");
    visit("arm", self.arm, "Arm.");
    visit("pile", self.pile, "Pile in the bin.");
    visit("pile_numbers", self.pile_numbers, "Numbers of the pellets of the pile.");
    visit("disturbed", self.disturbed, "Time at which the pile was last disturbed [s].");
    visit("pile_due", self.pile_due, "Time by which the pile is behind while it moves [s].");
    visit("pellets", self.pellets, "Pellets.");
    visit("gripper", self.gripper, "Gripper.");
    visit("peg", self.peg, "Motion of the pellet in the grip.");
    visit("T_base_tool", self.T_base_tool, "Tool in the base [m].");
    visit("velocity", self.velocity, "Velocity of the tool [m/s, rad/s].");
    visit("loose", self.loose, "Pellets that were let go.");
    visit("scanning", self.scanning, "Whether a scan is under way.");
    visit("scans", self.scans, "Number of scans.");
    visit("profiles", self.profiles, "Number of profiles of the line scanner.");
    visit("scan_times", self.scan_times, "Times of the profiles of the scan [s].");
    visit("scan_real", self.scan_real, "Flange in the base at them [m].");
    visit("scan_told", self.scan_told, "What the arm reported of it [m].");
  }
};

/// The cell where everything really is. One part a source: this one, its grip, its sensors.
struct WorkCell::World {
  WorkCellOptions options;
  Random random;
  cell::Cell believed, real;
  CommandedArm arm;
  CellSolids solids;
  PileDynamics pile;
  double grip_factor = 1.0;
  WorkCellRecord now;  ///< Arm, pile, peg and pegs of loose pellets apart, which keep their own.
  std::unique_ptr<HeldPeg> peg;
  std::vector<std::unique_ptr<HeldPeg>> loose;  ///< One for each of now.loose.

  World(const cell::Cell& cell, const WorkCellOptions& given);

  // work_cell_world.cpp: time
  void send(const robot::RobotCommand& command);
  void moved(double passed);
  void run_pile(double passed);
  void run_loose(double passed);
  bool settle_loose(std::size_t index, double passed);
  void drop_into_bin(std::size_t index);
  void note_resting();

  // work_cell_grip.cpp: what the gripper takes, holds and lets go
  void tell_gripper(const robot::GripperCommand& command);
  void close_gripper();
  void take(int number, const PelletTaken& taken, const GripOptions& by);
  void take_out_of_pile();
  void hold_in_pile();
  void watch_in_pile();
  void carry(const Pose& from, const Vector6& before, double passed);
  void press(const Pose& from, double passed);
  void lose_if_slipped();
  void let_go();
  Pose freed(int number, const Pose& T_base_pellet) const;
  Vector6 twist_at(const Eigen::Vector3d& point) const;
  /// Of what the tool carries, force and torque about a point in B.
  void touch_at(const Vector6& wrench, const Eigen::Vector3d& point);
  const GripOptions& grip_options() const { return now.gripper.told.fingers ? options.fingers : options.cup; }
  std::unique_ptr<HeldPeg> peg_of(int number, const Pose& T_pellet_peg, const Pose& T_tool_pellet, double height) const;
  Pose T_held_peg(const Pose& T_base_tool) const;

  PelletTruth& pellet(int number) { return now.pellets[static_cast<std::size_t>(number)]; }
  const PelletTruth& pellet(int number) const { return now.pellets[static_cast<std::size_t>(number)]; }
  CylinderBody body(int number) const;
  int body_in_pile(int number) const;
  WorkCellRecord record() const;
  void restore(const WorkCellRecord& from);
};

}  // namespace kr5::sim
