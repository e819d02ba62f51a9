// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/core/fields.hpp>

/// @file
/// The columns of every kind of experiment: the one place that knows their units and noise.

namespace kr5::cell {

/// What was done. Format `kr5-recording/1`.
enum class Kind {
  Motion,   ///< Free motion, a row every cycle.
  Poses,    ///< Static postures measured from outside.
  Views,    ///< Static views of the board.
  Scan,     ///< Line profiles of the target, scanner moving along its Y.
  Step,     ///< Steps of the path correction, free space.
  Press,    ///< Tool down on a flat bench at z = 0.
  Profile,  ///< Tilted peg rolled round the tube top under a held force.
};
constexpr auto enum_names(Kind) {
  using enum Kind;
  return names<Kind>({{Motion, "motion"},
                      {Poses, "poses"},
                      {Views, "views"},
                      {Scan, "scan"},
                      {Step, "step"},
                      {Press, "press"},
                      {Profile, "profile"}});
}

enum class Role {
  Given,      ///< Input of a simulation.
  Predicted,  ///< What a simulation must show.
};
constexpr auto enum_names(Role) { return names<Role>({{Role::Given, "given"}, {Role::Predicted, "predicted"}}); }

struct Column {
  std::string name;
  Role role = Role::Given;
  std::string unit;
  std::string noise;  ///< Key of `noise` in the cell; empty for what is given, or exact.
  /// Columns of one group are there together or not at all; an empty group must be there.
  std::string group;

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name in the header of the file.");
    visit("role", self.role, "given | predicted.");
    visit("unit", self.unit, "Unit.");
    visit("noise", self.noise, "Key of noise in the cell; empty for what is given, or exact.");
    visit("group", self.group, "Columns of a group are there together or not at all; without a group: always.");
  }
};

/// Columns of a kind for n joints, in the order of the files.
std::vector<Column> columns(Kind kind, int joints);

/// The column whose values keep a file's runs apart (`run`, `view`, ...); empty for `motion`, which has one.
std::string run_column(Kind kind);

}  // namespace kr5::cell
