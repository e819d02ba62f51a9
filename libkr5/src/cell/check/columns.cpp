// SPDX-License-Identifier: BSD-3-Clause
#include "cell/check/columns.hpp"

#include <algorithm>
#include <map>

namespace kr5::cell {
namespace {

/// `q7` of a cell with six joints.
bool is_joint_column(const std::string& name) {
  const std::size_t digits = name.find_first_of("0123456789");
  const std::string stem = name.substr(0, digits);
  return digits != std::string::npos && name.find_first_not_of("0123456789", digits) == std::string::npos &&
         (stem == "q" || stem == "qc" || stem == "i" || stem == "tau");
}

std::string unknown_hint(const std::string& name, const std::vector<std::string>& known, const Experiment& e,
                         int joints) {
  if (is_joint_column(name) && std::find(known.begin(), known.end(), "q1") != known.end())
    return "columns of " + std::to_string(joints) + " joints, as the cell has";
  const std::string near = io::nearest_name(name, known);
  if (!near.empty()) return "no such column; did you mean '" + near + "'?";
  std::string all = "a column of kind " + std::string(name_of(e.kind)) + ":";
  for (const std::string& k : known) all += " " + k;
  return all;
}

}  // namespace

bool check_columns(const Experiment& e, int joints, const std::string& file, std::vector<io::Diagnostic>& diagnostics) {
  const std::size_t before = diagnostics.size();
  const auto complain = [&](const std::string& column, const std::string& found, const std::string& expected) {
    diagnostics.push_back({file, 1, column, found, expected});
  };
  std::vector<std::string> known;
  std::map<std::string, std::pair<std::string, std::string>> groups;  // columns there, columns missing
  bool predicted = false;
  for (const Column& column : columns(e.kind, joints)) {
    const bool there = e.data.find(column.name) >= 0;
    known.push_back(column.name);
    predicted |= there && column.role == Role::Predicted;
    if (!there && column.role == Role::Given && column.group.empty())
      complain(column.name, "no such column", column.name + " [" + column.unit + "], required");
    // A sensor may lack an axis, and a drive its current; but a part of an orientation is none.
    if (column.group.empty() || (column.role == Role::Predicted && column.group != "orientation")) continue;
    auto& [have, lack] = groups[column.group];
    (there ? have : lack) += (there ? have : lack).empty() ? column.name : " " + column.name;
  }
  for (const auto& [group, names] : groups)
    if (!names.first.empty() && !names.second.empty())
      complain(names.second, "only " + names.first + " of the " + group, "all of them, or none");
  if (!predicted) complain("", "nothing measured", "at least one measured column");
  for (const std::string& name : e.data.columns)
    if (std::find(known.begin(), known.end(), name) == known.end())
      complain(name, "an unknown column", unknown_hint(name, known, e, joints));
  return diagnostics.size() == before;
}

}  // namespace kr5::cell
