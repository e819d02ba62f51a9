// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/log_problem.hpp>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <numeric>

#include "joint_columns.hpp"

namespace kr5::arm_log {

namespace {

std::string printed(const char* format, double value) {
  char out[48];
  std::snprintf(out, sizeof out, format, value);
  return out;
}

std::string range_of(double from, double to, const std::string& unit) {
  return printed("%.4g", from) + " to " + printed("%.4g", to) + " " + unit;
}

std::string in_millimetres(const char* format, double metres) { return printed(format, 1e3 * metres) + " mm"; }

std::string position_unit(const cell::Cell& cell, int joint) { return load_unit(cell, joint) == "N" ? "m" : "rad"; }

std::string times_simulation(double factor) { return printed("%.3g", factor) + " times what the simulation shows"; }

std::string names_in_order(const cell::Cell& cell, const std::vector<int>& order) {
  std::string out;
  for (const int joint : order) {
    const std::string name =
        cell.robot.joint_names.empty() ? "joint" + std::to_string(joint + 1) : joint_name(cell, joint);
    out += (out.empty() ? "" : ", ") + name;
  }
  return out;
}

std::vector<int> model_order(const cell::Cell& cell) {
  std::vector<int> out(static_cast<std::size_t>(cell.robot.joints()));
  std::iota(out.begin(), out.end(), 0);
  return out;
}

/// Joints that are counted in another direction, or from another zero.
std::string convention_text(const JointReading& reading, const cell::Cell& cell) {
  std::string out;
  for (std::size_t k = 0; k < reading.sign.size(); ++k) {
    if (reading.sign[k] > 0 && reading.zero[k] == 0.0) continue;
    out += (out.empty() ? "" : " and ") + joint_name(cell, static_cast<int>(k)) + " counted";
    if (reading.sign[k] < 0) out += " in the other direction";
    if (reading.zero[k] != 0.0)
      out += std::string(reading.sign[k] < 0 ? " and" : "") + " from a zero " +
             printed("%.0f", std::abs(reading.zero[k]) * 180 / std::numbers::pi) + " degrees away";
  }
  return out;
}

std::string cycle_text(const LogProblem& problem) {
  return problem.expected > 0 ? "a row every " + printed("%g", problem.expected) + " s"
                              : "speeds within the limits of the cell";
}

/// What helps where no other reading of the numbers makes sense.
std::string check_text(const LogProblem& problem) {
  switch (problem.kind) {
    case LogProblemKind::BeyondLimits:
      return "check these columns, their order and their offsets, and that this is the model of their robot";
    case LogProblemKind::NeverMoves:
      return "was its motor on, and is this its column? Log it while it moves, or end the arm before it with --tip "
             "LINK";
    case LogProblemKind::SpeedBeyond:
    case LogProblemKind::RowsApart:
      return "check the unit and the column of the clock";
    case LogProblemKind::Constant:
      return "check that the driver measures efforts and that publishing them is turned on";
    case LogProblemKind::Copy:
      return "one of the two columns is not that of its joint: name the columns of both";
    case LogProblemKind::Unsigned:
      return "the driver logs magnitudes only: log signed loads, or, where commands were logged, leave the loads out";
    case LogProblemKind::Wrapped:
      return "they were read as unsigned numbers: subtract this where the value is above half of it, and diagnose "
             "again";
    case LogProblemKind::Saturated:
      return "sensor, driver or logger clip it: record again with a wider range or a gentler motion";
    case LogProblemKind::Weightless:
      return "the controller took gravity from what it logs, or the direction of gravity in the cell is wrong: log the "
             "whole load of each joint";
    case LogProblemKind::FactorOfJoint:
      return "are they per cent of a rated torque, or currents? State what 1 of the log is for each joint";
    case LogProblemKind::UnknownFactor:
      return "check unit and side of these columns, and torque constants, structure and masses of the cell";
    case LogProblemKind::ToolElsewhere:
      return "are joint angles, their order and the cell's tool right?";
    default:
      return "is this the right column, did the controller remove gravity from it, is the direction of gravity in the "
             "cell right, and are joint directions and zeros those of the log?";
  }
}

/// What helps where commands are none that a servo follows.
std::string use_measured_text(const LogProblem& problem) {
  const std::string what = problem.kind == LogProblemKind::CommandsMeasured
                               ? "the log is of an arm that was led, or its "
                                 "commands were not stored"
                           : problem.kind == LogProblemKind::CommandsAreSpeeds
                               ? "are they speeds, or changes of the position a row?"
                               : "are they poses of the tool, of another arm, or in another order?";
  return what + (what.back() == '?' ? " Name" : "; name") +
         " the commanded positions of the joints, or, where efforts were logged, take what was measured for the motion";
}

/// What was found where commands are none that a servo follows.
std::string found_commands_text(const LogProblem& problem) {
  switch (problem.kind) {
    case LogProblemKind::CommandsMeasured:
      return problem.found > 0 ? "the positions that are measured " + printed("%g", problem.found) +
                                     (problem.found > 1 ? " rows" : " row") + " later, in every row"
                               : std::string("the measured positions, in every row");
    case LogProblemKind::CommandsAreSpeeds:
      return "commands that the speeds of the joints follow, not their positions (correlation " +
             printed("%.2f", problem.found) + ")";
    case LogProblemKind::CommandsScaled:
      return "positions that follow with " + printed("%.3g", problem.found) + " to " +
             printed("%.3g", problem.found_to) + " times the command, or from another zero";
    default:
      return "commands that the joints do not follow (correlation " + printed("%.2f", problem.found) + " at most)";
  }
}

/// What was found where the numbers of a load cannot be those of one.
std::string found_readings_text(const LogProblem& problem) {
  switch (problem.kind) {
    case LogProblemKind::Constant:
      return "the same value in every row (" + printed("%g", problem.found) + " in " + problem.columns.front() + ")";
    case LogProblemKind::Copy:
      return "the load of joint " + std::to_string(problem.other + 1) + ", or a multiple of it, in every row";
    case LogProblemKind::Unsigned:
      return "values of one sign only, where the simulation has both";
    case LogProblemKind::Wrapped:
      return "negative values as large numbers, " + printed("%.6g", problem.found) + " too large";
    default:
      return "a value that stays at its extreme from " + printed("%.3f", problem.found) + " to " +
             printed("%.3f", problem.found_to) + " s while the arm moves";
  }
}

}  // namespace

std::string columns_text(const LogProblem& problem) {
  const auto& names = problem.columns;
  if (names == std::vector<std::string>{"x", "y", "z"}) return "x y z";
  const bool all = problem.kind != LogProblemKind::SomeOpposite && problem.kind != LogProblemKind::Unsigned &&
                   problem.kind != LogProblemKind::Wrapped;
  if (all && names.size() == 2) return names[0] + " and " + names[1];
  if (all && names.size() > 2) return names.front() + " to " + names.back();
  std::string out;
  for (const std::string& name : names) out += (out.empty() ? "" : ", ") + name;
  return out;
}

std::string found_text(const LogProblem& problem, const cell::Cell& cell) {
  switch (problem.kind) {
    case LogProblemKind::BeyondLimits:
      return range_of(problem.found, problem.found_to, position_unit(cell, problem.joint));
    case LogProblemKind::HardlyMoves:
      return "no joint farther than " + printed("%.3g", problem.found) + " rad from zero";
    case LogProblemKind::FollowsAnother:
      return "that it follows qc" + std::to_string(problem.other + 1) + ", and is " + printed("%.3g", problem.found) +
             " from qc" + std::to_string(problem.joint + 1);
    case LogProblemKind::CommandsMeasured:
    case LogProblemKind::CommandsAreSpeeds:
    case LogProblemKind::CommandsScaled:
    case LogProblemKind::CommandsUnlike:
      return found_commands_text(problem);
    case LogProblemKind::NeverMoves:
      return "a joint that moves by " + printed("%.2g", problem.found) + " " + position_unit(cell, problem.joint);
    case LogProblemKind::StopsFollowing:
      return "that it follows its command up to " + printed("%.4g", problem.found) +
             " s and not from there on, as with its motor switched off";
    case LogProblemKind::SpeedBeyond:
      return "joints that move at " + printed("%.3g", problem.found) + " times their limit of speed";
    case LogProblemKind::RowsApart:
      return "a row every " + printed("%.3g", problem.found) + " s";
    case LogProblemKind::Constant:
    case LogProblemKind::Copy:
    case LogProblemKind::Unsigned:
    case LogProblemKind::Wrapped:
    case LogProblemKind::Saturated:
      return found_readings_text(problem);
    case LogProblemKind::Order:
    case LogProblemKind::Convention:
      return "loads that do not fit the motion";
    case LogProblemKind::Weightless:
      return "loads as of an arm without weight";
    case LogProblemKind::OppositeSign:
    case LogProblemKind::SomeOpposite:
      return "the opposite sign to the simulation";
    case LogProblemKind::Factor:
    case LogProblemKind::UnknownFactor:
      return times_simulation(problem.found);
    case LogProblemKind::FactorOfJoint:
      return printed("%.3g", problem.found) + " to " + times_simulation(problem.found_to) +
             ", a different factor for each joint";
    case LogProblemKind::Swapped:
      return "each like the simulation of the other (correlation " + printed("%.2f", problem.found) + ", own " +
             printed("%.2f", problem.found_to) + ")";
    case LogProblemKind::Unlike:
      return "a correlation of " + printed("%.2f", problem.found) + " with the simulation";
    case LogProblemKind::ToolScale:
      return "positions that spread " + printed("%.3g", problem.found) + " times as far as the cell's tool";
    case LogProblemKind::ToolFrame:
      return "a tool " + in_millimetres("%.4g", problem.found) + " from its position by the cell, " +
             in_millimetres("%.3g", problem.found_to) + " after a rigid transformation";
    case LogProblemKind::ToolElsewhere:
      return "a tool " + in_millimetres("%.4g", problem.found) + " (median) from its position by the cell";
  }
  return {};
}

std::string expected_text(const LogProblem& problem, const cell::Cell& cell) {
  switch (problem.kind) {
    case LogProblemKind::BeyondLimits:
      return range_of(problem.expected, problem.expected_to, position_unit(cell, problem.joint));
    case LogProblemKind::HardlyMoves:
      return "a motion of some size";
    case LogProblemKind::FollowsAnother:
      return "its own command";
    case LogProblemKind::CommandsMeasured:
    case LogProblemKind::CommandsAreSpeeds:
    case LogProblemKind::CommandsUnlike:
      return "the positions that the servos were told to reach";
    case LogProblemKind::CommandsScaled:
      return "commands in the unit of the positions, from the same zero";
    case LogProblemKind::NeverMoves:
      return "a motion beside its command, which moves by " + printed("%.2g", problem.expected) + " " +
             position_unit(cell, problem.joint);
    case LogProblemKind::StopsFollowing:
      return "a motor that is on";
    case LogProblemKind::SpeedBeyond:
    case LogProblemKind::RowsApart:
      return cycle_text(problem);
    case LogProblemKind::Constant:
    case LogProblemKind::Saturated:
      return "values that follow the motion";
    case LogProblemKind::Copy:
      return "a load of its own";
    case LogProblemKind::Unsigned:
    case LogProblemKind::Wrapped:
      return "loads with their sign";
    case LogProblemKind::Order:
      return "the order of the model: " + names_in_order(cell, model_order(cell));
    case LogProblemKind::Convention:
      return "joints counted as in the model";
    case LogProblemKind::Weightless:
      return "those of gravity, too";
    case LogProblemKind::OppositeSign:
      return "the same sign";
    case LogProblemKind::SomeOpposite:
      return "the same sign as in the other columns";
    case LogProblemKind::Factor:
    case LogProblemKind::UnknownFactor:
    case LogProblemKind::FactorOfJoint:
      return "a factor near 1";
    case LogProblemKind::Swapped:
      return "each similar to its own";
    case LogProblemKind::Unlike:
      return "visible gravity and inertia of the arm";
    case LogProblemKind::ToolScale:
      return "about as far";
    case LogProblemKind::ToolFrame:
      return "poses in the base of the robot";
    case LogProblemKind::ToolElsewhere:
      return "agreement within a few per cent of the reach";
  }
  return {};
}

std::string remedy_text(const LogProblem& problem, const cell::Cell& cell) {
  const bool loads = problem.kind == LogProblemKind::Factor;
  switch (problem.remedy) {
    case LogRemedy::Check:
      return check_text(problem);
    case LogRemedy::Degrees:
      return "the numbers make sense as degrees (mm for a slide)";
    case LogRemedy::Radians:
      return problem.kind == LogProblemKind::HardlyMoves ? "are the numbers radians, which were read as degrees?"
                                                         : "the numbers make sense as radians (m for a slide)";
    case LogRemedy::MotorSide:
      return loads ? "they are torques on the motor side" : "the numbers make sense on the motor side";
    case LogRemedy::DegreesOnMotorSide:
      return "the numbers make sense as degrees on the motor side";
    case LogRemedy::Milliseconds:
      return "the clock makes sense in ms";
    case LogRemedy::Microseconds:
      return "the clock makes sense in us";
    case LogRemedy::Nanoseconds:
      return "the clock makes sense in ns";
    case LogRemedy::LongerUnit:
      return "the clock makes sense in a unit a thousand times longer";
    case LogRemedy::Reverse:
      return "turn their sign, or correct the directions of the joints";
    case LogRemedy::ReverseSome:
      return "turn its sign, and that of the positions of the joint, too, if its direction is reversed";
    case LogRemedy::Thousandth:
      return "the unit is a thousandth of the one that was read";
    case LogRemedy::Thousand:
      return "the unit is a thousand times the one that was read";
    case LogRemedy::PercentOfEffort:
      return "they are percent of the limits of effort of the model";
    case LogRemedy::MotorTorques:
      return "they are torques of the motors";
    case LogRemedy::JointTorques:
      return "they are torques of the joints";
    case LogRemedy::Currents:
      return "they are currents";
    case LogRemedy::Exchange:
      return "columns are swapped: exchange their names";
    case LogRemedy::Rearrange:
      return "they fit with the joints in the order " + names_in_order(cell, problem.reading.order) +
             ": name the columns in the order of the model";
    case LogRemedy::Recount:
      return "they fit with " + convention_text(problem.reading, cell);
    case LogRemedy::UseMeasured:
      return use_measured_text(problem);
    case LogRemedy::ScaleCommands:
      return "bring them to the positions";
    case LogRemedy::CutLog:
      return "use the log up to there";
    case LogRemedy::PositionMetre:
      return "the positions make sense in m";
    case LogRemedy::PositionCentimetre:
      return "the positions make sense in cm";
    case LogRemedy::PositionMillimetre:
      return "the positions make sense in mm";
    case LogRemedy::DeviceFrame:
      return "the device measures in its own frame";
  }
  return {};
}

std::string text(const LogProblem& problem, const cell::Cell& cell) {
  const bool named = problem.joint >= 0 && !cell.robot.joint_names.empty();
  return problem.experiment + ": " + columns_text(problem) +
         (named ? " (" + joint_name(cell, problem.joint) + ")" : "") + ": found " + found_text(problem, cell) +
         ", expected " + expected_text(problem, cell) + "; " + remedy_text(problem, cell);
}

std::string mismatch_text() {
  return "the log and the model do not fit together as they were read. Is this the model of the robot that was logged?";
}

}  // namespace kr5::arm_log
