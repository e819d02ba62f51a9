// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <kr5/cell/recording.hpp>
#include <kr5/io/node.hpp>
#include <kr5/io/problem.hpp>

namespace kr5::cell {

/// A YAML file, or nothing and a problem.
std::optional<io::Node> read_document(const std::filesystem::path& file, std::vector<io::Problem>& problems);

/// A recording as far as it could be read.
struct ReadRecording {
  Recording recording;
  bool cell_usable = false;
  std::vector<std::vector<int>> lines;  ///< Of each experiment, the line of each row.
  std::vector<bool> usable;             ///< Of each experiment: it has all its columns and some rows.
};

/// Collects every problem of form, those of the cell included.
ReadRecording read_recording(const std::filesystem::path& folder, std::vector<io::Problem>& problems);

/// Columns that are missing, unknown, or only part of a group. True when there are none.
bool check_columns(const Experiment& experiment, int joints, const std::string& file,
                   std::vector<io::Problem>& problems);

/// Values that no recording of this cell has.
void check_data(const Experiment& experiment, const Cell& cell, const std::string& file, const std::vector<int>& lines,
                std::vector<io::Problem>& problems);

}  // namespace kr5::cell
