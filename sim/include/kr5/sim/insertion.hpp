// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/force/insertion.hpp>
#include <kr5/io/csv.hpp>

/// @file
/// Insertions in the simulated cell: the arm in DART behind its servo and delay, the peg in a compliant grip, the
/// wrist sensor with its noise, the tube at its true pose, and the force::Insertion that would run on the cell.

namespace kr5::sim {

enum class Strategy {
  ProfileFit,  ///< Fit of the whole profile, entry rim first, giving way to what is felt.
  Hayat2022,  ///< Cusp of the profile, upright slide along its direction (Hayat et al. 2022, algorithm of section 5.6).
};
constexpr auto enum_names(Strategy) {
  return names<Strategy>({{Strategy::ProfileFit, "profile_fit"}, {Strategy::Hayat2022, "hayat2022"}});
}

/// Task, and uncertainty of the cell.
struct InsertionSetup {
  double clearance = 2.8e-4;                         ///< [m]
  double tilt = 0.2618;                              ///< [rad]
  Eigen::Vector2d offset = Eigen::Vector2d::Zero();  ///< [m]
  bool horizontal = false;
  Strategy strategy = Strategy::ProfileFit;
  force::InsertBy insert_by = force::InsertBy::Arm;
  int pegs = 1;
  double pick_distance = 0.06;       ///< [m]
  double repeatability = 1e-4;       ///< [m]
  double grip_error = 1e-4;          ///< [m]
  double grip_tilt = 1.5e-3;         ///< [rad]
  double tube_tilt = 1.5e-3;         ///< [rad]
  double face_error = 2e-4;          ///< [m]
  double stiffness_error = 0.1;      ///< [-]
  double servo_error = 0.0;          ///< [-]
  double friction_error = 0.0;       ///< [-]
  double cycle_jitter = 0.0;         ///< [s]
  double grip_force = 0.0;           ///< [N]
  double grip_torque = 0.0;          ///< [N m]
  double lateral_stiffness = 0;      ///< [N/m]
  double angular_stiffness = 300.0;  ///< [N m/rad]
  bool noise = true;
  bool log = true;
  std::uint64_t seed = 1;

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("clearance", self.clearance, "Clearance: radius of the bore minus that of the peg; it sets the bore [m].");
    visit("tilt", self.tilt, "Tilt of the peg while it is rolled around the tube [rad].");
    visit("offset", self.offset, "Offset of the actual axis of the tube from the assumed one, x and y of T [m].");
    visit("horizontal", self.horizontal, "Horizontal tube along Y of the base, instead of a vertical one.");
    visit("strategy", self.strategy, "Strategy by which the hole is found: profile_fit | hayat2022.");
    visit("insert_by", self.insert_by, "Source of the force that pushes the peg in: arm | gravity | air.");
    visit("pegs", self.pegs, "Number of pegs, one after the other; each starts from the hole of the previous one.");
    visit("pick_distance", self.pick_distance, "Distance from the tube to the pick position of the next peg [m].");
    visit("repeatability", self.repeatability, "Repeatability of the arm, three standard deviations per axis [m].");
    visit("grip_error", self.grip_error,
          "Standard deviation of the position of the peg in the grip, per axis across it [m].");
    visit("grip_tilt", self.grip_tilt, "Standard deviation of the tilt of the peg in the grip, per axis [rad].");
    visit("tube_tilt", self.tube_tilt, "Standard deviation of the tilt of the tube, per axis [rad].");
    visit("face_error", self.face_error, "Standard deviation of the assumed height of the face of the tube [m].");
    visit("stiffness_error", self.stiffness_error,
          "Relative standard deviation of the actual stiffness of contact and grip from the assumed one [-].");
    visit("servo_error", self.servo_error,
          "Relative standard deviation of natural frequency and damping of the actual path servo from those assumed by "
          "the insertion [-].");
    visit("friction_error", self.friction_error,
          "Relative standard deviation of the actual friction of peg on tube from that of the cell [-].");
    visit("cycle_jitter", self.cycle_jitter,
          "Most by which a cycle is longer or shorter than the insertion believes, evenly distributed [s].");
    visit("grip_force", self.grip_force, "Force at which the peg slips in the grip; 0: it does not [N].");
    visit("grip_torque", self.grip_torque, "Torque at which it turns in the grip; 0: it does not [N m].");
    visit("lateral_stiffness", self.lateral_stiffness,
          "Stiffness of the grip across the peg; 0: as contact.stiffness along it [N/m].");
    visit("angular_stiffness", self.angular_stiffness, "Stiffness of the grip against tilting [N m/rad].");
    visit("noise", self.noise, "Noise of sensors and arm, and random errors of grip and tube.");
    visit("log", self.log, "Log of every cycle in the rows of the result.");
    visit("seed", self.seed, "Random seed.");
  }
};

/// Outcome of one peg.
struct PegOutcome {
  bool inserted = false;
  force::Phase phase = force::Phase::Tare;
  force::Reason reason = force::Reason::None;
  int attempts = 0;
  double time = 0.0;                               ///< [s]
  double depth = 0.0;                              ///< [m]
  Eigen::Vector3d hole = Eigen::Vector3d::Zero();  ///< [m]
  double hole_error = 0.0;                         ///< [m]
  double hole_std = 0.0;                           ///< [m]
  double max_force = 0.0;                          ///< [N]

  static void each_field(auto& self, auto&& visit) {
    visit("inserted", self.inserted, "Whether the peg is in the tube, to at least nine tenths of the depth.");
    visit("phase", self.phase, "Phase in which the insertion ended.");
    visit("reason", self.reason, "Reason for the end.");
    visit("attempts", self.attempts, "Number of attempts.");
    visit("time", self.time, "Time from above the tube, or from picking the peg, to the end [s].");
    visit("depth", self.depth, "Depth of the bottom of the peg below the face [m].");
    visit("hole", self.hole, "Centre of the face of the tube by the last fit of a profile, in T [m].");
    visit("hole_error", self.hole_error, "Error of the axis of the tube in that fit; NaN: no fit [m].");
    visit("hole_std", self.hole_std, "Standard deviation of the fit in its least certain direction; 0: no fit [m].");
    visit("max_force", self.max_force, "Maximum force between grip and peg [N].");
  }
};

struct InsertionResult {
  bool inserted = false;         ///< Every peg is in.
  double time = 0.0;             ///< Of all pegs, ways between them too [s].
  std::vector<PegOutcome> pegs;  ///< Outcome of each.
  /// A row each cycle: t; peg, phase, attempt (numbers of force::Phase); x y z tilt azimuth according to the arm, in T;
  /// fx..tz on the peg, unfiltered, in T; true_x true_y true_z true_tilt of the peg from the real tube; q1..n
  /// [s, m, rad, N, N m].
  io::Table rows;
  /// Of the last turn: azimuth, tilt, x, y, height as measured; closed_form, where it really stood; force,
  /// moment_x, moment_y about the bottom centre, axes of T [rad, m, N, N m].
  io::Table profile;
  cell::Cell cell;                        ///< As it was run: bore, pose of the tube.
  Pose T_tube_actual = Pose::Identity();  ///< The tube as it really stood, from where it is believed.
};

/// Inserts pegs. A tube that is out of reach, a peg that is too wide and the like are outcomes.
/// With options, `tilt`, `strategy` and `insert_by` of the setup are ignored in favour of the options.
/// @throws InvalidArgument for a setup or options that are not valid, and for a cell that lacks something.
InsertionResult run_insertion(const cell::Cell& cell, const InsertionSetup& setup = {});
InsertionResult run_insertion(const cell::Cell& cell, const InsertionSetup& setup,
                              const force::InsertionOptions& options);

}  // namespace kr5::sim
