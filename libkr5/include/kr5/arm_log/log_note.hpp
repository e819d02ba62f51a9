// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/core/fields.hpp>

namespace kr5::arm_log {

/// What was taken of a log, or added to its model, that a person should know.
enum class LogNoteKind {
  NoDrives,         ///< The model states none: friction and rotor inertia begin at 0.
  NoTool,           ///< The model states none: nothing is taken to hang on the flange.
  TorqueConstants,  ///< `values` with `deviations`, a joint each, from the log [N m/A or N/A].
  TorqueNoise,      ///< Of the joint torques, follows from that of the currents.
  JointNoise,       ///< `values`, a joint each, of the family `name` (`tau` [N m or N], `i` [A]).
  ColouredNoise,  ///< Of `joints` in the family `name`: `values` [N m, N or A], neighbours correlated by `deviations`.
  ChannelNoise,   ///< `value` of the key `name` of the noise.
  UnmeasuredLoads,     ///< `joints` whose loads show hardly anything.
  DelayedLoads,        ///< The loads of family `name` match the motion best if logged `value` [s] late.
  SmoothedPositions,   ///< At `value` [Hz].
  EvenClock,           ///< The stamps came late; the samples were even.
  MeasuredForCommand,  ///< Measured positions stand for the motion.
  CutAtRest,           ///< Up to `value` [s] to fit, cut where the arm rests.
  Cut,                 ///< Up to `value` [s] to fit, cut in motion.
  Stretches,           ///< `value` stretches of a long log are compared.
  UnknownDirections,   ///< `values`, a joint each: share of rows in which its direction is not known [-].
  TorqueScale,         ///< No loads were logged: torques have the scale of the masses of the model.
};
constexpr auto enum_names(LogNoteKind) {
  using enum LogNoteKind;
  return names<LogNoteKind>({{NoDrives, "no_drives"},
                             {NoTool, "no_tool"},
                             {TorqueConstants, "torque_constants"},
                             {TorqueNoise, "torque_noise"},
                             {JointNoise, "joint_noise"},
                             {ColouredNoise, "coloured_noise"},
                             {ChannelNoise, "channel_noise"},
                             {UnmeasuredLoads, "unmeasured_loads"},
                             {DelayedLoads, "delayed_loads"},
                             {SmoothedPositions, "smoothed_positions"},
                             {EvenClock, "even_clock"},
                             {MeasuredForCommand, "measured_for_command"},
                             {CutAtRest, "cut_at_rest"},
                             {Cut, "cut"},
                             {Stretches, "stretches"},
                             {UnknownDirections, "unknown_directions"},
                             {TorqueScale, "torque_scale"}});
}

struct LogNote {
  LogNoteKind kind = LogNoteKind::NoDrives;
  std::string name = {};
  double value = 0.0;
  std::vector<double> values = {};
  std::vector<double> deviations = {};  ///< Of `values`; of coloured noise its correlations.
  std::vector<int> joints = {};         ///< From 0.

  static void each_field(auto& self, auto&& visit) {
    visit("kind", self.kind, "What the note tells.");
    visit("name", self.name, "Family of columns (tau, i) or key of the noise that it tells of.");
    visit("value", self.value, "The number that it tells, in the unit of its kind.");
    visit("values", self.values, "The numbers of all joints, in the unit of its kind.");
    visit("deviations", self.deviations, "Standard deviations of values; of coloured noise correlations.");
    visit("joints", self.joints, "Joints that it tells of, from 0.");
  }
};

/// A note in a sentence, without full stop; `cell` names joints and units.
std::string text(const LogNote& note, const cell::Cell& cell);

}  // namespace kr5::arm_log
