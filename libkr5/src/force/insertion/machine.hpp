// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <span>

#include <kr5/force/compliance.hpp>
#include <kr5/force/guarded_move.hpp>
#include <kr5/force/insertion.hpp>
#include <kr5/force/safety_stop.hpp>
#include <kr5/force/wrench_conditioner.hpp>

#include "force/insertion/tilted_path.hpp"
#include "force/search/tube_search.hpp"
#include "force/search/turn_profile.hpp"

namespace kr5::force {

inline constexpr double met_part = 0.5;  // of the force of a push, at which it has met something

SafetyLimits safety_limits(const InsertionOptions& options);
GuardedMoveOptions guarded_move_options(const InsertionOptions& options);
/// At which what is met is touched with no more than the limit of force when the arm is stopped at once [m/s].
double guarded_speed(const InsertionOptions& options);
/// The same of a push, which gives way to what it meets [m/s].
double guarded_push_speed(const InsertionOptions& options);

/// What a reading says of the peg, in T.
struct PegReading {
  const robot::RobotReading& told;
  Pose T_tube_peg;
  Vector6 wrench;  ///< As wrench_on_peg [N, N m].

  PegReading(const InsertionFrames& frames, const robot::RobotReading& reading) noexcept
      : told(reading), T_tube_peg(force::T_tube_peg(frames, reading)), wrench(wrench_on_peg(frames, reading)) {}
  std::span<const double> currents() const noexcept {
    return {told.currents.data(), static_cast<std::size_t>(told.currents.size())};
  }
};

/// What is felt in a cycle, forces and places equally late.
struct ContactEstimate {
  Eigen::Vector3d arm = Eigen::Vector3d::Zero();     ///< Bottom centre as the arm believes, in T [m].
  Eigen::Vector3d peg = Eigen::Vector3d::Zero();     ///< The same with what gives way [m].
  double tilt = 0.0, azimuth = 0.0;                  ///< With what gives way [rad].
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< On the peg, in T [N].
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  ///< About the bottom centre [N m].

  double press() const { return force.z(); }
  Eigen::Vector2d across() const { return force.head<2>(); }
};

struct Insertion::Machine {
  InsertionOptions options;
  InsertionFrames frames;
  InsertionState state;
  SafetyStop guard;
  WrenchLowPass force_filter, place_filter;
  GuardedMove descent;
  TubeSearch search;
  TurnProfile turn;
  TiltedPath path;
  Axis lean, round;       ///< Tilt and its azimuth, where they are planned.
  ContactEstimate sharp;  ///< Unfiltered: a filter would round the cusp of a profile, and a fit averages by itself.
  Vector6 zero = Vector6::Zero(), sum = Vector6::Zero(), squares = Vector6::Zero();
  double zero_std = 0.0;                     ///< Of the peg's place in the grip, for what is not known of the zero [m].
  std::optional<Eigen::Vector3d> last_hole;  ///< Of the last success, in T [m].
  Eigen::Vector2d place = Eigen::Vector2d::Zero();       ///< Where the next attempt touches, in T [m].
  Eigen::Vector3d last_place = Eigen::Vector3d::Zero();  ///< Of the peg by the last reading, in T [m].
  Eigen::Vector2d begun = Eigen::Vector2d::Zero();       ///< Where a slide or a spiral began.
  double face = 0.0;                                     ///< Believed height of the tube's face [m].
  double compliance_error = 0.0;                         ///< Of what gives way along the peg, beyond belief [m/N].
  double careful = 0.0, most_push = 0.0;                 ///< Speeds where something may be met [m/s].
  double begun_height = 0.0;                             ///< At which this phase began, in T [m].
  double toward = 0.0;                                   ///< Azimuth of the hole [rad].
  double angle_swept = 0.0, level = 0.0,
         feed = 0.0;  ///< Of a turn or a spiral; height of a peg that slides; of a push.
  int cycles = 0, settled_cycles = 0, late_cycles = 0;  ///< In this phase; of them, at rest in a row; of them, late.
  bool known = false, first = true, probing = false, doubtful = false, spiralled = false, felt_again = false,
       holding = true, air = false,
       met = false;  ///< Something was met before the approach was at its end.

  Machine(const InsertionOptions& given, const InsertionFrames& given_frames);

  robot::RobotCommand step(const robot::RobotReading& robot_reading) noexcept;
  void restart() noexcept;

  // Common to all phases.
  ContactEstimate contact_estimate(const Vector6& wrench, const Vector6& place6) const noexcept;
  ContactEstimate estimate_contact(const PegReading& reading) noexcept;
  void enter_phase(Phase phase) noexcept;
  void stop_for(Reason reason) noexcept;
  /// Ends the attempt: another one from above, or none.
  void end_attempt(Reason reason) noexcept;
  double force_to_come(const PegReading& reading) noexcept;
  void check_limits(const PegReading& reading, const ContactEstimate& now) noexcept;
  void run_phase(const PegReading& reading, const ContactEstimate& now) noexcept;
  void come_to_rest(const PegReading& reading, const ContactEstimate& now) noexcept;
  double seconds() const noexcept { return cycles * options.cycle; }
  bool settled_for(double time, bool settled_now) noexcept;
  double press_speed(double reference, const ContactEstimate& now) const noexcept;
  /// Moves across the tube, the press held; tilt as planned.
  void drive(const Eigen::Vector2d& across, double along) noexcept;
  void plan_tilt(double lean_speed, double round_speed) noexcept;
  /// What is planned of the tilt goes on from where the path is.
  void plan_from_path() noexcept;
  /// Where the planned azimuth is that of the hole, the shortest way round [rad].
  double nearest_turn() const noexcept;
  Eigen::Vector2d lateral_admittance(const ContactEstimate& now, const Eigen::Vector2d& reference) const noexcept;
  /// The bottom of the peg is below the face: the rim is in the bore.
  bool captured(const ContactEstimate& now) const noexcept { return now.peg.z() < face - options.limits.face_error; }
  /// How far behind its axis a tilted peg just falls into the bore.
  double capture_offset() const noexcept;
  Eigen::Vector2d direction() const noexcept { return {std::cos(toward), std::sin(toward)}; }
  double tilted_height() const noexcept;
  /// A time to wait, or what a way at the speed of contact takes with as much again.
  double waiting(double least, double way) const noexcept {
    return std::max(least, 2 * way / options.motion.contact_speed);
  }
  /// For a force to settle before one goes on all the same [s].
  double settle_timeout() const noexcept { return waiting(1.5, options.forces.roll / options.grip.axial); }

  // One function a phase.
  void tare() noexcept;
  void approach() noexcept;
  void meet() noexcept;
  double approach_speed() const noexcept;
  bool come() noexcept;
  void touch(const ContactEstimate& now) noexcept;
  void roll(const ContactEstimate& now) noexcept;
  void locate(const ContactEstimate& now) noexcept;
  void aim(const ContactEstimate& now) noexcept;
  void slide(const ContactEstimate& now) noexcept;
  void slide_tilted(const ContactEstimate& now) noexcept;
  void slide_upright(const ContactEstimate& now) noexcept;
  void upright(const ContactEstimate& now) noexcept;
  void feel_again() noexcept;
  void settle_upright(const ContactEstimate& now) noexcept;
  void push(const PegReading& reading, const ContactEstimate& now) noexcept;
  void confirm(const ContactEstimate& now) noexcept;
  void let_go(const PegReading& reading, const ContactEstimate& now) noexcept;
  void finish_inserted(const ContactEstimate& now) noexcept;
  void begin_spiral(const ContactEstimate& now) noexcept;
  void spiral(const ContactEstimate& now) noexcept;
  void retreat(const ContactEstimate& now) noexcept;

  void accept_location(bool fitted) noexcept;
  /// Standard deviation of the fitted centre in the direction in which it is least known.
  double fit_std() const noexcept;
  void begin_entry(double azimuth) noexcept;
};

}  // namespace kr5::force
