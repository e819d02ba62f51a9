// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/core/fields.hpp>

/// @file
/// State of an insertion, the reason of its end, and the profile it measured. Frame T as in insertion.hpp.

namespace kr5::force {

enum class Phase {
  Tare,
  Approach,
  Touch,
  Roll,
  Locate,
  Aim,
  Slide,
  Upright,
  Confirm,  ///< Whether the peg is in the bore, or beside the tube.
  Push,
  Spiral,
  Retreat,
  Done,
  Stopped,
};
constexpr auto enum_names(Phase) {
  using enum Phase;
  return names<Phase>({{Tare, "tare"},
                       {Approach, "approach"},
                       {Touch, "touch"},
                       {Roll, "roll"},
                       {Locate, "locate"},
                       {Aim, "aim"},
                       {Slide, "slide"},
                       {Upright, "upright"},
                       {Confirm, "confirm"},
                       {Push, "push"},
                       {Spiral, "spiral"},
                       {Retreat, "retreat"},
                       {Done, "done"},
                       {Stopped, "stopped"}});
}

/// Why an attempt, or everything, ended.
enum class Reason {
  None,
  Inserted,
  PegTooWide,    ///< By the radii it was given.
  UnstableGain,  ///< A gain that the delay of the loop does not bear.
  NoContact,     ///< Nothing was touched where the tube should be.
  Obstructed,    ///< Something was touched where nothing should be, above the tube.
  ProfileFlat,   ///< No direction in the profile of the turn.
  NoDrop,        ///< Slid as far as allowed and never dropped.
  Blocked,       ///< In the mouth of the bore it went no deeper.
  Force,         ///< Limit of force.
  Torque,        ///< Limit of torque.
  Current,       ///< Limit of a motor current.
  SensorDead,    ///< The sensor told the same to the last bit for too long, or no numbers.
  SensorSaturated,
  PegLost,     ///< The grip says it holds nothing.
  OutOfReach,  ///< The arm cannot follow.
  TimeOut,
};
constexpr auto enum_names(Reason) {
  using enum Reason;
  return names<Reason>({{None, "none"},
                        {Inserted, "inserted"},
                        {PegTooWide, "peg_too_wide"},
                        {UnstableGain, "unstable_gain"},
                        {NoContact, "no_contact"},
                        {Obstructed, "obstructed"},
                        {ProfileFlat, "profile_flat"},
                        {NoDrop, "no_drop"},
                        {Blocked, "blocked"},
                        {Force, "force"},
                        {Torque, "torque"},
                        {Current, "current"},
                        {SensorDead, "sensor_dead"},
                        {SensorSaturated, "sensor_saturated"},
                        {PegLost, "peg_lost"},
                        {OutOfReach, "out_of_reach"},
                        {TimeOut, "time_out"}});
}

/// Measurement at one azimuth of the turn.
struct ProfileRow {
  double azimuth = 0.0;                              ///< Of the lowest point of the rim [rad].
  double tilt = 0.0;                                 ///< [rad]
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< Bottom centre in T, what gives way taken into account [m].
  double height = 0.0;                               ///< Of it [m].
  double force = 0.0;                                ///< Along Z of T [N].
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();  ///< About the bottom centre [N m].

  static void each_field(auto& self, auto&& visit) {
    visit("azimuth", self.azimuth, "Azimuth of the lowest point of the rim [rad].");
    visit("tilt", self.tilt, "Tilt of the peg [rad].");
    visit("centre", self.centre, "Bottom centre in T, corrected for compliance [m].");
    visit("height", self.height, "Height of that centre in T [m].");
    visit("force", self.force, "Force on the peg along Z of T [N].");
    visit("moment", self.moment, "Moment on the peg about its bottom centre, x and y of T [N m].");
  }
};

/// State of an insertion.
struct InsertionState {
  Phase phase = Phase::Tare;
  Reason reason = Reason::None;    ///< Of the last attempt that ended, or of the stop.
  Phase stopped_in = Phase::Tare;  ///< The phase in which the reason arose.
  int attempt = 1;
  double time = 0.0;                               ///< Since the first step [s].
  Eigen::Vector3d hole = Eigen::Vector3d::Zero();  ///< Where the hole is believed, in T [m].
  double hole_std = 0.0;                           ///< Across the tube, where it is least known; 0: not fitted [m].
  double depth = 0.0;                              ///< Of the peg's bottom below the believed face [m].

  static void each_field(auto& self, auto&& visit) {
    visit("phase", self.phase, "Current phase.");
    visit("reason", self.reason, "Reason for which the last attempt, or the insertion, ended.");
    visit("stopped_in", self.stopped_in, "Phase in which that reason arose.");
    visit("attempt", self.attempt, "Number of the attempt, from 1.");
    visit("time", self.time, "Time since the first step [s].");
    visit("hole", self.hole, "Assumed centre of the hole, in T [m].");
    visit("hole_std", self.hole_std,
          "Standard deviation of the hole across the tube in its least known direction; 0: not fitted [m].");
    visit("depth", self.depth, "Depth of the peg's bottom below the assumed face [m].");
  }
};

}  // namespace kr5::force
