// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <kr5/cell/recording.hpp>
#include <kr5/io/diagnostic.hpp>
#include <kr5/io/node.hpp>

namespace kr5::cell {

/// A YAML file, or nothing and a problem.
std::optional<io::Node> read_document(const std::filesystem::path& file, std::vector<io::Diagnostic>& diagnostics);

/// A recording as far as it could be read.
struct ReadRecording {
  Recording recording;
  bool cell_usable = false;
  std::vector<std::vector<int>> lines;  ///< Of each experiment, the line of each row.
  std::vector<bool> usable;             ///< Of each experiment: it has all its columns and some rows.
};

/// Collects every problem of form, those of the cell included.
ReadRecording read_recording(const std::filesystem::path& folder, std::vector<io::Diagnostic>& diagnostics);

/// Collects what the values of a recording of usable form say: units of the cell, parts and noise that the experiments
/// need, data. Written in check/check.cpp.
void check_recording(const ReadRecording& read, const io::Node& root, const std::string& cell_file,
                     std::vector<io::Diagnostic>& diagnostics);

}  // namespace kr5::cell
