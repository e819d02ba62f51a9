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

/// @file
/// Insertion of a peg into a tube by force control (Hayat et al. 2022, algorithm of section 5.6, and 6.4): tilted
/// touch, turn, slide, upright, push; a new attempt when it did not go in. No clock, socket or robot is inside: whoever
/// owns those calls `step` once a cycle. Frame T: origin at the believed centre of the tube's top face, Z out of the
/// tube, whichever way that lies in the cell. Frame P: bottom centre of the peg, Z along its axis, up.

namespace kr5::force {

struct InsertionOptions {
  PegTube bodies;
  double tilt = 0.2618;          ///< [rad]
  double azimuth = 0.0;          ///< [rad]
  double cycle = 0.012;          ///< [s]
  double cutoff = 8.0;           ///< [Hz]
  double delay = 0.024;          ///< [s]
  double servo_frequency = 0.0;  ///< [rad/s]
  double servo_damping = 0.75;   ///< [-]
  Localisation localisation = Localisation::Fit;
  Entry entry = Entry::Tilted;
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

/// Reading of the cell in one cycle: pose and forces of one instant. When the forces are 18 ms older than the pose, as
/// with an unmatched filter in a sensor, the fitted hole is some 0.3 mm off.
struct InsertionReading {
  Pose T_tube_peg = Pose::Identity();  ///< As the arm believes.
  Vector6 sensor = Vector6::Zero();    ///< As the sensor tells it, in its own axes [N, N m].
  Vector6 wrench = Vector6::Zero();    ///< Of the environment on the peg, about the origin of P, axes of T; no weight.
  std::span<const double> current;     ///< Of each motor [A]; may be empty.
  bool saturated = false;              ///< The sensor is at its limit.
  bool gripped = true;                 ///< The grip holds something.
  bool reachable = true;               ///< The arm could go where the last command was.
};

/// Command to the cell for one cycle.
struct InsertionCommand {
  Pose T_tube_peg = Pose::Identity();  ///< What the arm is told: where it shall hold the peg, led ahead for its servo.
  bool hold = true;                    ///< The grip holds; otherwise it lets the peg slide along.
  bool air = false;                    ///< Compressed air on the peg.
  bool stop = false;                   ///< Stop the arm where it is; stays so.
};

/// One insertion. Everything is allocated by the constructor; `step` neither allocates nor throws.
class Insertion {
 public:
  /// @throws InvalidArgument as InsertionOptions::validate.
  explicit Insertion(const InsertionOptions& options);
  ~Insertion();
  Insertion(Insertion&&) noexcept;
  Insertion& operator=(Insertion&&) noexcept;

  /// One cycle.
  InsertionCommand step(const InsertionReading& reading) noexcept;
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
