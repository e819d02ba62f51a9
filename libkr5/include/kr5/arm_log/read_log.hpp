// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <kr5/arm_log/arm_log.hpp>
#include <kr5/cell/cell.hpp>
#include <kr5/io/csv.hpp>

namespace kr5::arm_log {

/// Names of the columns of a log, one a joint in the order of the model. What is empty is found by its name.
struct LogColumns {
  std::string time;
  std::vector<std::string> q;
  std::vector<std::string> command;
  std::vector<std::string> effort;
  std::vector<std::string> current;

  static void each_field(auto& self, auto&& visit) {
    visit("time", self.time, "Column of the time; empty: found by its name.");
    visit("q", self.q, "Columns of the measured positions, one a joint in the order of the model.");
    visit("command", self.command, "Columns of the setpoints.");
    visit("effort", self.effort, "Columns of the efforts.");
    visit("current", self.current, "Columns of the motor currents.");
  }
};

/// The columns of a table by their names: those that hold the name of a joint of the model and a word of a quantity
/// (`/joint_states/elbow_joint/position`), else a word or letter and the number of the joint (`q1`, `effort_1`,
/// `position[0]`, `joint1_pos`). Quantities of which some joints have no column are left empty, and those of motors.
/// Names that are given stay. @see column_words.hpp for the words
/// @throws InvalidArgument where no column looks like a time or like positions, some joints have none, or a column
/// states a unit of another quantity.
LogColumns find_columns(const std::vector<std::string>& names, const cell::Cell& cell, const LogColumns& given = {});

/// The log in a table. A unit in a name counts: `_deg`, `[mm]`, `(ms)`, `_mA`, `[N mm]`; else numbers are SI, and the
/// stamps in the unit that guess_time_unit finds.
/// @throws InvalidArgument as find_columns, or naming a column that is not there.
ArmLog log_of(const io::Table& table, const cell::Cell& cell, const LogColumns& columns = {});

/// The log in a file of comma-separated numbers under one header line.
/// @throws IoError as io::load_csv, InvalidArgument as log_of, both with the file.
ArmLog read_log(const std::filesystem::path& file, const cell::Cell& cell, const LogColumns& columns = {});

}  // namespace kr5::arm_log
