// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/cell/columns.hpp>
#include <kr5/core/fields.hpp>
#include <kr5/io/csv.hpp>

/// @file
/// What a cell did and what its sensors showed: format `kr5-recording/1`, a folder with recording.yaml and CSV files.

namespace kr5::cell {

enum class Split {
  Fit,    ///< May be used to estimate.
  Check,  ///< Only to judge.
};
constexpr auto enum_names(Split) { return names<Split>({{Split::Fit, "fit"}, {Split::Check, "check"}}); }

struct Experiment {
  std::string name;
  Kind kind = Kind::Motion;
  std::string file;  ///< In the folder of the recording.
  Split split = Split::Fit;
  io::Table data;  ///< Columns as `columns(kind, joints)` describes them.

  static constexpr std::array<std::string_view, 4> required = {"name", "kind", "file", "split"};
  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the experiment.");
    visit("kind", self.kind, "Kind: motion | poses | views | scan | step | press | profile.");
    visit("file", self.file, "CSV file in the folder of the recording.");
    visit("split", self.split, "Use of the data: fit (estimation) | check (validation only).");
  }
};

struct Recording {
  std::string cell_file = "cell.yaml";  ///< In the folder of the recording.
  Cell cell;                            ///< What is believed about the cell that was recorded.
  std::vector<Experiment> experiments;
  std::filesystem::path folder;  ///< Where it was read from.

  /// @throws InvalidArgument naming the experiment and those there are.
  const Experiment& experiment(const std::string& name) const;
};

/// Reads recording.yaml, the cell and every CSV file of a folder.
/// @throws IoError with every error: keys, files, columns missing or unknown, rows, numbers, the cell. Warnings are for
///         `check`.
Recording load_recording(const std::filesystem::path& folder);

/// Writes recording.yaml, the cell and the CSV files into a folder, which is made when it is not there. Reads back bit
/// for bit. @throws IoError naming the file.
void save_recording(const Recording& recording, const std::filesystem::path& folder);

}  // namespace kr5::cell
