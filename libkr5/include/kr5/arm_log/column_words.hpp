// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/core/fields.hpp>

/// @file
/// What the columns of a log show, by the words of their names: the one list of these words, which the reader of logs
/// in C++ (read_log.hpp) and those of `kr5.logs` ask. A *stem* is a name in which `#` stands for the joint.

namespace kr5::arm_log {

/// What a word of a name tells.
enum class ColumnWord {
  None,
  Position,
  Velocity,
  Acceleration,
  Effort,
  Current,
  Command,   ///< That it is asked for.
  Measured,  ///< That it was measured.
  Other,     ///< That it is no reading of a joint that a cell could show.
};
constexpr auto enum_names(ColumnWord) {
  using enum ColumnWord;
  return names<ColumnWord>({{None, "none"},
                            {Position, "position"},
                            {Velocity, "velocity"},
                            {Acceleration, "acceleration"},
                            {Effort, "effort"},
                            {Current, "current"},
                            {Command, "command"},
                            {Measured, "measured"},
                            {Other, "other"}});
}

/// A quantity of all joints, named as its columns in a recording.
enum class ColumnFamily { None, Position, Command, Velocity, Effort, Current };
constexpr auto enum_names(ColumnFamily) {
  using enum ColumnFamily;
  return names<ColumnFamily>(
      {{None, "none"}, {Position, "q"}, {Command, "qc"}, {Velocity, "qd"}, {Effort, "tau"}, {Current, "i"}});
}

/// @param word In small letters.
ColumnWord meaning_of(const std::string& word);

/// The words of a name in small letters, parted at capitals too, run-together commands as one (`qcmd` is qc); `#` and
/// `%` are words.
std::vector<std::string> words_of(const std::string& name);

/// The quantity of a stem: its field says it, and the topic that publishes it only where the field does not.
ColumnFamily family_of(const std::string& stem);

/// Whether angles or torques of a stem are those of motors, not of joints. A current is that of a motor anyway.
bool on_motor_side(const std::string& stem);

/// The unit that a word of a stem states, as in io::column_units, or `%`; empty without one.
std::string unit_in(const std::string& stem);

/// Whether a name is that of what grasps, which is no joint of the arm.
bool names_gripper(const std::string& name);

/// Whether the name of a column, behind its topic, is that of a time.
bool names_time(const std::string& name);

/// The unit of time that a name ends in (`time_ms`, `t [ns]`): s | ms | us | ns; empty without one.
std::string time_unit_in(const std::string& name);

}  // namespace kr5::arm_log
