// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <span>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/force/insertion_options.hpp>
#include <kr5/force/insertion_state.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/robot/command.hpp>
#include <kr5/robot/cycle.hpp>
#include <kr5/robot/reading.hpp>

/// @file
/// Insertion of a peg into a tube by force control (Hayat et al. 2022, algorithm of section 5.6, and 6.4): tilted
/// touch, turn, slide, upright, push; a new attempt when it did not go in. No clock, socket or robot is inside: whoever
/// owns those calls `step` once a cycle. Frame T: origin at the believed centre of the tube's top face, Z out of the
/// tube, whichever way that lies in the cell. Frame P: bottom centre of the peg, Z along its axis, up.

namespace kr5::force {

struct InsertionOptions {
  PegTube bodies;
  double tilt = 0.2618;               ///< [rad]
  double azimuth = 0.0;               ///< [rad]
  double cycle = robot::usual_cycle;  ///< [s]
  double cutoff = 8.0;                ///< [Hz]
  double delay = 0.024;               ///< [s]
  double servo_frequency = 0.0;       ///< [rad/s]
  double servo_damping = 0.75;        ///< [-]
  Localisation localisation = Localisation::Fit;
  EntryAttitude entry = EntryAttitude::Tilted;
  InsertBy insert_by = InsertBy::Arm;
  std::optional<Eigen::Vector3d> hole;  ///< [m]
  GripModel grip;
  InsertionForces forces;
  InsertionMotion motion;
  InsertionLimits limits;

  /// @throws InvalidArgument naming the field that is no number, or has the wrong sign. A peg that is too wide and a
  /// gain that is not stable are no broken contract: they are stated as a Reason.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("bodies", self.bodies, "Assumed radii of peg and tube.");
    visit("tilt", self.tilt, "Tilt of the peg during the turn [rad].");
    visit("azimuth", self.azimuth, "Azimuth of the lowest point of its rim at the first touch [rad].");
    visit("cycle", self.cycle, "Time between two steps [s].");
    visit("cutoff", self.cutoff, "Cut-off frequency of the low-pass on forces and positions [Hz].");
    visit("delay", self.delay, "Delay from a command to its effect, for the check of the gains [s].");
    visit("servo_frequency", self.servo_frequency,
          "Natural frequency of the servo behind the commands, which its inverse compensates; 0: none [rad/s].");
    visit("servo_damping", self.servo_damping, "Damping ratio of that servo [-].");
    visit("localisation", self.localisation, "Localisation of the hole: fit | cusp | minimum.");
    visit("entry", self.entry, "Entry of the peg: tilted | upright.");
    visit("insert_by", self.insert_by, "Drive of the insertion: arm | gravity | air.");
    visit("hole", self.hole, "Centre of a previously found hole, in T, which is tried first [m].");
    visit("grip", self.grip, "Compliance between arm and peg.");
    visit("forces", self.forces, "Forces and gains.");
    visit("motion", self.motion, "Speeds and distances.");
    visit("limits", self.limits, "Limits that stop the insertion.");
  }
};

/// Where the task stands on the robot: the tube in the base and the peg in the tool, as both are believed. As they are,
/// robot and task have one frame.
struct InsertionFrames {
  Pose T_base_tube = Pose::Identity();
  Pose T_tool_peg = Pose::Identity();

  /// @throws InvalidArgument naming the pose that is no rigid motion.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("T_base_tube", self.T_base_tube, "Tube in the base, as it is believed [m].");
    visit("T_tool_peg", self.T_tool_peg, "Peg in the tool: its bottom centre, Z along its axis, up [m].");
  }
};

/// Pose of the peg against the tube, as the arm believes.
Pose T_tube_peg(const InsertionFrames& frames, const robot::RobotReading& reading) noexcept;
/// Wrench of the environment on the peg, about the origin of P, axes of T, without weight [N, N m].
Vector6 wrench_on_peg(const InsertionFrames& frames, const robot::RobotReading& reading) noexcept;
/// Where the tool is that holds the peg at a pose in T.
Pose T_base_tool(const InsertionFrames& frames, const Pose& T_tube_peg) noexcept;

/// One insertion. Everything is allocated by the constructor; `step` neither allocates nor throws.
class Insertion {
 public:
  /// @throws InvalidArgument as InsertionOptions::validate and InsertionFrames::validate.
  explicit Insertion(const InsertionOptions& options, const InsertionFrames& frames = {});
  ~Insertion();
  Insertion(Insertion&&) noexcept;
  Insertion& operator=(Insertion&&) noexcept;

  /// One cycle: the pose at which the tool shall be, led ahead for the servo of the arm, and what the gripper does.
  /// A command to stop stays one.
  robot::RobotCommand step(const robot::RobotReading& reading) noexcept;
  const InsertionState& state() const noexcept;
  bool finished() const noexcept;
  /// Measured profile of the last turn, by azimuth; empty before one.
  std::span<const ProfileRow> profile() const noexcept;
  /// Begins anew; the hole of the last success, if there was one, is remembered.
  void restart() noexcept;

 private:
  struct Machine;
  std::unique_ptr<Machine> machine_;
};

}  // namespace kr5::force
