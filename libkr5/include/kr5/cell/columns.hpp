// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/core/fields.hpp>

/// @file
/// The columns of every kind of experiment: the single definition of their meaning, their units
/// and noise.

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
  std::string name = {};
  Role role = Role::Given;
  std::string unit = {};
  std::string noise = {};      ///< Key of `noise` in the cell; empty for given or exact columns.
  std::string group = {};      ///< Columns of one group are there together or not at all; an empty group must be there.
  std::string target = {};     ///< Target of the catalogue nearest to it: joint3, fx, tool, camera...
  std::string subsystem = {};  ///< Part of the cell that it tells of.
  std::string channel = {};    ///< Quantity.
  std::string label = {};
  std::string component = {};  ///< Of a wrench, the label without where it is measured: force x.
  int joint = -1;              ///< Joint that it belongs to, from 0; -1: none.

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name in the header of the file.");
    visit("role", self.role, "Role: given | predicted.");
    visit("unit", self.unit, "Unit.");
    visit("noise", self.noise, "Key of `noise` in the cell; empty for given or exact columns.");
    visit("group", self.group, "Group of columns that are present together or not at all; empty: always present.");
    visit("target", self.target, "Nearest target of the catalogue, e.g. joint3, fx, camera; empty for given columns.");
    visit("subsystem", self.subsystem, "Part of the cell that the column measures; empty for given columns.");
    visit("channel", self.channel, "Quantity, e.g. motor current; empty for given columns.");
    visit("label", self.label, "Name in reports, e.g. current of joint 3.");
    visit("component", self.component, "Component of a wrench, e.g. force x; empty for other columns.");
    visit("joint", self.joint, "Index of its joint, from 0; -1 for none.");
  }
};

/// Group of the columns that hold an orientation: a quaternion in files, rx ry rz where recordings are compared.
inline constexpr const char* orientation_group = "orientation";

/// Columns of a kind for n joints, in the order of the files.
std::vector<Column> columns(Kind kind, int joints);

/// Columns in which a recording and a simulation of a kind are compared: those predicted with noise, an orientation as
/// rx ry rz [rad], the rotation vector Log(R_simulated^T R_recorded).
std::vector<Column> compared_columns(Kind kind, int joints);

/// A column of a kind by its name, also of those compared.
/// @throws InvalidArgument for a name that the kind has not.
const Column& find_column(Kind kind, const std::string& name);

/// The column whose values keep a file's runs apart (`run`, `view`, ...); empty for `motion`, which has one.
std::string run_column(Kind kind);

}  // namespace kr5::cell
