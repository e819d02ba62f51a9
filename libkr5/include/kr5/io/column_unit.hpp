// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/core/fields.hpp>

/// @file
/// Units of the columns of tables and logs, and how names of columns state them: the one list of them, for C++ and
/// Python.

namespace kr5::io {

/// A unit in which numbers may be given.
struct ColumnUnit {
  std::string quantity;
  std::string name;
  double factor = 1.0;

  static void each_field(auto& self, auto&& visit) {
    visit(
        "quantity", self.quantity,
        "What is measured in it: angle | length | time | current | force | torque | turn rate | speed | pixel | none.");
    visit("name", self.name, "Name of the unit.");
    visit("factor", self.factor, "What one of it is in SI.");
  }
};

/// All units; those of a quantity follow each other, that of SI first.
const std::vector<ColumnUnit>& column_units();

/// The unit that a text means, also in another spelling (`degrees`, `sec`, `ma`, `N.m`); null where it means none.
const ColumnUnit* find_unit(const std::string& text);

/// The name of a column, and the unit that it ends in.
struct UnitName {
  std::string name;
  std::string unit;

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name without the unit.");
    visit("unit", self.unit, "Unit as it is written; empty without one.");
  }
};

/// Takes the unit off the name of a column: whatever stands in brackets and is no number, which is an index
/// (`q1 [deg]`, `tx (N mm)`), else a unit behind an underscore that can hardly be anything else (`x_mm`, `q1_deg`).
UnitName split_unit(const std::string& column);

}  // namespace kr5::io
