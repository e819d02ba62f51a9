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

/// What the columns qc of a motion hold.
enum class JointReference {
  Commanded,  ///< Setpoints, which pass through the servos.
  Measured,   ///< Measured positions, smoothed: what the motors did, so that no servo stands between.
};
constexpr auto enum_names(JointReference) {
  return names<JointReference>({{JointReference::Commanded, "commanded"}, {JointReference::Measured, "measured"}});
}

struct Experiment {
  std::string name;
  Kind kind = Kind::Motion;
  std::string file;  ///< In the folder of the recording.
  Split split = Split::Fit;
  io::Table data;  ///< Columns as `columns(kind, joints)` describes them.
  JointReference joint_reference = JointReference::Commanded;
  /// Rows before `data`, of the same columns: simulated, so that the simulation enters `data` in motion, and not
  /// compared. May be empty. In a file they stand before the others, and `lead_in` tells how long they last [s].
  io::Table lead_in;
  /// Standard deviation of the speed that the measured positions in qc give each joint; empty: their speeds are exact
  /// [rad/s or m/s].
  Eigen::VectorXd speed_noise = {};

  static constexpr std::array<std::string_view, 4> required = {"name", "kind", "file", "split"};
  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the experiment.");
    visit("kind", self.kind, "Kind: motion | poses | views | scan | step | press | profile.");
    visit("file", self.file, "CSV file in the folder of the recording.");
    visit("split", self.split, "Use of the data: fit (estimation) | check (validation only).");
    visit("joint_reference", self.joint_reference,
          "Values in qc: commanded (setpoints of the servos) | measured (smoothed readings, which the motors follow).");
    visit("speed_noise", self.speed_noise,
          "Standard deviation of the speed that the measured positions in qc give each joint; empty: exact [rad/s or "
          "m/s].");
  }
};

/// The experiment with its lead-in as part of the data.
Experiment with_lead_in(const Experiment& experiment);
/// The experiment with the rows of its first `duration` seconds as lead-in; none for 0.
/// @throws InvalidArgument when no row is left, or t is missing.
Experiment split_lead_in(const Experiment& experiment, double duration);

/// How fast a joint moves when its readings begin, by a parabola through the first of them: as few as their noise
/// allows, four at least, or those of 0.1 s.
struct InitialSpeed {
  double value = 0.0;       ///< [rad/s or m/s]
  double noise_gain = 0.0;  ///< Standard deviation of `value` over that of one reading [1/s].
};
/// @param t Times, n, rising [s]. @param q Positions, n [rad or m]. 0 for fewer than four readings.
InitialSpeed initial_speed(const Eigen::VectorXd& t, const Eigen::VectorXd& q);

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
