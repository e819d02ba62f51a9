// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/arm_log/joint_reading.hpp>
#include <kr5/cell/recording.hpp>
#include <kr5/core/fields.hpp>

/// @file
/// What speaks against the columns of a log as they were read: numbers that make sense in another unit, on the other
/// side of the gears, or in other columns. Positions are held against the limits of the cell, loads against what the
/// fast simulator shows for the same motion, measured poses of the tool against where the cell puts it.

namespace kr5::arm_log {

/// What is wrong. `found` and `expected` of a problem are what stands in brackets.
enum class LogProblemKind {
  BeyondLimits,       ///< Positions of a joint (from, to) beyond its limits (from, to) [rad or m].
  HardlyMoves,        ///< No joint farther than `found` [rad] from zero, as of radians that were read as degrees.
  FollowsAnother,     ///< A measured joint follows the command of joint `other`, `found` from its own [rad or m].
  CommandsMeasured,   ///< Commands that are the positions measured `found` rows later.
  CommandsAreSpeeds,  ///< Commands that the speeds of the joints follow (correlation `found` at least).
  CommandsScaled,     ///< Positions follow with `found` to `found_to` times the command, or from another zero.
  CommandsUnlike,     ///< Commands that no joint follows (correlation `found` at most).
  NeverMoves,         ///< A joint that moves by `found` beside a command that moves by `expected` [rad or m].
  StopsFollowing,     ///< A joint that follows its command up to `found` [s], and not from there on.
  SpeedBeyond,        ///< Joints that move at `found` times their limit of speed.
  RowsApart,          ///< A row every `found` [s], beside a servo of another cycle.
  Constant,           ///< Loads that are the same (`found`) in every row.
  Copy,               ///< A load that is that of joint `other`, or that times a factor, in every row.
  Unsigned,           ///< Loads without their sign: where the simulation is negative, they are positive.
  Wrapped,            ///< Negative loads that were read as unsigned numbers, `found` too large.
  Saturated,          ///< A load that stays at its extreme, from `found` to `found_to` [s], while the arm moves.
  Order,              ///< Loads that fit with the joints in the order of `reading`.
  Convention,         ///< Loads that fit with joints counted as in `reading`.
  Weightless,         ///< Loads as of an arm without weight.
  OppositeSign,       ///< Every load of the opposite sign to the simulation.
  SomeOpposite,       ///< Some loads of the opposite sign.
  Factor,             ///< `found` times what the simulation shows, as another unit or side of the gears gives.
  FactorOfJoint,      ///< `found` to `found_to` times, a different factor for each joint.
  UnknownFactor,      ///< `found` times, for no reason that is known.
  Swapped,            ///< Two loads each like the simulation of the other (correlation `found`, own `found_to`).
  Unlike,             ///< A correlation of `found` of the largest load with its simulation.
  ToolScale,          ///< Measured tool positions that spread `found` times as far as the cell's tool.
  ToolFrame,          ///< Measured tool positions `found` off the cell's, `found_to` from `T_base_device` [m].
  ToolElsewhere,      ///< Measured tool positions `found` off the cell's, in any frame [m].
};
constexpr auto enum_names(LogProblemKind) {
  using enum LogProblemKind;
  return names<LogProblemKind>({{BeyondLimits, "beyond_limits"},
                                {HardlyMoves, "hardly_moves"},
                                {FollowsAnother, "follows_another"},
                                {CommandsMeasured, "commands_measured"},
                                {CommandsAreSpeeds, "commands_are_speeds"},
                                {CommandsScaled, "commands_scaled"},
                                {CommandsUnlike, "commands_unlike"},
                                {NeverMoves, "never_moves"},
                                {StopsFollowing, "stops_following"},
                                {SpeedBeyond, "speed_beyond"},
                                {RowsApart, "rows_apart"},
                                {Constant, "constant"},
                                {Copy, "copy"},
                                {Unsigned, "unsigned"},
                                {Wrapped, "wrapped"},
                                {Saturated, "saturated"},
                                {Order, "order"},
                                {Convention, "convention"},
                                {Weightless, "weightless"},
                                {OppositeSign, "opposite_sign"},
                                {SomeOpposite, "some_opposite"},
                                {Factor, "factor"},
                                {FactorOfJoint, "factor_of_joint"},
                                {UnknownFactor, "unknown_factor"},
                                {Swapped, "swapped"},
                                {Unlike, "unlike"},
                                {ToolScale, "tool_scale"},
                                {ToolFrame, "tool_frame"},
                                {ToolElsewhere, "tool_elsewhere"}});
}

/// How the numbers would make sense.
enum class LogRemedy {
  Check,               ///< No reading of them is known that does.
  Degrees,             ///< Degrees (mm of a slide).
  Radians,             ///< Radians (m of a slide).
  MotorSide,           ///< On the motor side of the gears.
  DegreesOnMotorSide,  ///< Both.
  Milliseconds,        ///< Of the clock.
  Microseconds,        ///< Of the clock.
  Nanoseconds,         ///< Of the clock.
  LongerUnit,          ///< Of the clock: a unit a thousand times longer.
  Reverse,             ///< All with the other sign.
  ReverseSome,         ///< Columns of the problem with the other sign.
  Thousandth,          ///< In a thousandth of the unit that was read.
  Thousand,            ///< In a thousand of the unit that was read.
  PercentOfEffort,     ///< In per cent of the limits of effort of the model.
  MotorTorques,        ///< Torques of the motors in place of currents.
  JointTorques,        ///< Torques of the joints in place of currents.
  Currents,            ///< Currents in place of torques.
  Exchange,            ///< The two columns, one for the other.
  Rearrange,           ///< Columns in the order of `reading`.
  Recount,             ///< Joints counted as in `reading`.
  UseMeasured,         ///< Measured positions in place of the commands.
  ScaleCommands,       ///< Commands times `factors` plus `offsets`.
  CutLog,              ///< The log up to `found` [s] alone.
  PositionMetre,       ///< Positions of the tool in metres.
  PositionCentimetre,  ///< In centimetres.
  PositionMillimetre,  ///< In millimetres.
  DeviceFrame,         ///< Poses of the tool in the frame of the device, which stands at `T_base_device`.
};
constexpr auto enum_names(LogRemedy) {
  using enum LogRemedy;
  return names<LogRemedy>({{Check, "check"},
                           {Degrees, "degrees"},
                           {Radians, "radians"},
                           {MotorSide, "motor_side"},
                           {DegreesOnMotorSide, "degrees_on_motor_side"},
                           {Milliseconds, "milliseconds"},
                           {Microseconds, "microseconds"},
                           {Nanoseconds, "nanoseconds"},
                           {LongerUnit, "longer_unit"},
                           {Reverse, "reverse"},
                           {ReverseSome, "reverse_some"},
                           {Thousandth, "thousandth"},
                           {Thousand, "thousand"},
                           {PercentOfEffort, "percent_of_effort"},
                           {MotorTorques, "motor_torques"},
                           {JointTorques, "joint_torques"},
                           {Currents, "currents"},
                           {Exchange, "exchange"},
                           {Rearrange, "rearrange"},
                           {Recount, "recount"},
                           {UseMeasured, "use_measured"},
                           {ScaleCommands, "scale_commands"},
                           {CutLog, "cut_log"},
                           {PositionMetre, "position_metre"},
                           {PositionCentimetre, "position_centimetre"},
                           {PositionMillimetre, "position_millimetre"},
                           {DeviceFrame, "device_frame"}});
}

struct LogProblem {
  LogProblemKind kind = LogProblemKind::Unlike;
  LogRemedy remedy = LogRemedy::Check;
  std::string experiment = {};
  std::vector<std::string> columns = {};  ///< That it speaks of.
  int joint = -1;                         ///< Of the only column, from 0; -1: none.
  int other = -1;                         ///< The other joint of FollowsAnother and Copy, from 0.
  double found = 0.0, found_to = 0.0;
  double expected = 0.0, expected_to = 0.0;
  JointReading reading = {};              ///< Of Order and Convention.
  std::vector<double> factors = {};       ///< Of CommandsScaled, a joint each [-].
  std::vector<double> offsets = {};       ///< Of CommandsScaled, a joint each [rad or m].
  Pose T_base_device = Pose::Identity();  ///< Of ToolFrame.

  static void each_field(auto& self, auto&& visit) {
    visit("kind", self.kind, "What is wrong.");
    visit("remedy", self.remedy, "How the numbers would make sense.");
    visit("experiment", self.experiment, "Name of the experiment.");
    visit("columns", self.columns, "Columns that it speaks of.");
    visit("joint", self.joint, "Joint of the only column, from 0; -1: none.");
    visit("other", self.other, "Joint whose command it follows, or whose load it copies, from 0; -1: none.");
    visit("found", self.found, "What was found, or where it begins, as the kind says.");
    visit("found_to", self.found_to, "Where it ends.");
    visit("expected", self.expected, "What was expected, or where it begins.");
    visit("expected_to", self.expected_to, "Where it ends.");
    visit("reading", self.reading, "Order, directions and zeros with which the loads fit.");
    visit("factors", self.factors, "Of each joint: position over command [-].");
    visit("offsets", self.offsets, "Of each joint: position where the command is zero [rad or m].");
    visit("T_base_device", self.T_base_device, "Pose of the measuring device with which the tool positions fit.");
  }
};

/// The columns that it speaks of, in words.
std::string columns_text(const LogProblem& problem);
/// What was found, in words; the cell names joints and units.
std::string found_text(const LogProblem& problem, const cell::Cell& cell);
/// What was expected, in words.
std::string expected_text(const LogProblem& problem, const cell::Cell& cell);
/// What helps, in words.
std::string remedy_text(const LogProblem& problem, const cell::Cell& cell);
/// Experiment, columns, found, expected and remedy in a sentence.
std::string text(const LogProblem& problem, const cell::Cell& cell);
/// What is to be said of a log with problems as a whole.
std::string mismatch_text();

/// What speaks against the positions, the clock and the measured poses of the tool of an experiment.
std::vector<LogProblem> check_positions(const cell::Cell& cell, const cell::Experiment& experiment);

/// What speaks against the currents, torques and wrenches of a motion whose positions are right; nothing of other
/// kinds. Descriptions of robots may state friction that is no more than a placeholder: what is recognised and fits
/// without it is not objected to.
std::vector<LogProblem> check_loads(const cell::Cell& cell, const cell::Experiment& experiment);

}  // namespace kr5::arm_log
