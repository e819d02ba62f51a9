// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/io/column_unit.hpp>

#include <algorithm>
#include <cctype>
#include <numbers>
#include <set>
#include <utility>

namespace kr5::io {
namespace {

constexpr double pi = std::numbers::pi;

/// Other spellings of units, the small letters of those that are told by them alone.
const std::vector<std::pair<std::string, std::string>> spellings = {
    {"°", "deg"},      {"degree", "deg"}, {"degrees", "deg"}, {"grad", "deg"}, {"radian", "rad"}, {"radians", "rad"},
    {"sec", "s"},      {"seconds", "s"},  {"msec", "ms"},     {"usec", "us"},  {"µs", "us"},      {"nsec", "ns"},
    {"nanosec", "ns"}, {"N·m", "N m"},    {"N*m", "N m"},     {"N.m", "N m"},  {"N·mm", "N mm"},  {"nm", "N m"},
    {"nmm", "N mm"},   {"ma", "mA"},      {"a", "A"},         {"n", "N"}};

/// Units, in small letters, that behind an underscore are no name of anything else.
const std::set<std::string> suffixes = {"rad", "deg", "degrees", "mm", "ms", "us", "ns", "ma", "nm", "nmm"};

std::string in_small_letters(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

std::string trimmed(const std::string& text) {
  constexpr const char* blanks = " \t";
  const std::size_t first = text.find_first_not_of(blanks);
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

const ColumnUnit* unit_named(const std::string& name) {
  const auto at = std::ranges::find(column_units(), name, &ColumnUnit::name);
  return at == column_units().end() ? nullptr : &*at;
}

const ColumnUnit* unit_spelt(const std::string& text) {
  const auto at = std::ranges::find(spellings, text, &std::pair<std::string, std::string>::first);
  return at == spellings.end() ? nullptr : unit_named(at->second);
}

}  // namespace

const std::vector<ColumnUnit>& column_units() {
  static const std::vector<ColumnUnit> units = {{"angle", "rad", 1.0},
                                                {"angle", "mrad", 1e-3},
                                                {"angle", "deg", pi / 180},
                                                {"angle", "turn", 2 * pi},
                                                {"angle", "tick", pi / 2048},
                                                {"length", "m", 1.0},
                                                {"length", "cm", 1e-2},
                                                {"length", "mm", 1e-3},
                                                {"length", "um", 1e-6},
                                                {"time", "s", 1.0},
                                                {"time", "ms", 1e-3},
                                                {"time", "us", 1e-6},
                                                {"time", "ns", 1e-9},
                                                {"current", "A", 1.0},
                                                {"current", "mA", 1e-3},
                                                {"force", "N", 1.0},
                                                {"force", "kN", 1e3},
                                                {"force", "mN", 1e-3},
                                                {"torque", "N m", 1.0},
                                                {"torque", "Nm", 1.0},
                                                {"torque", "N mm", 1e-3},
                                                {"torque", "Nmm", 1e-3},
                                                {"torque", "mN m", 1e-3},
                                                {"torque", "mNm", 1e-3},
                                                {"torque", "kN m", 1e3},
                                                {"turn rate", "rad/s", 1.0},
                                                {"turn rate", "deg/s", pi / 180},
                                                {"turn rate", "rpm", pi / 30},
                                                {"speed", "m/s", 1.0},
                                                {"speed", "mm/s", 1e-3},
                                                {"pixel", "px", 1.0},
                                                {"none", "-", 1.0}};
  return units;
}

const ColumnUnit* find_unit(const std::string& text) {
  if (const ColumnUnit* unit = unit_named(text)) return unit;
  if (const ColumnUnit* unit = unit_spelt(text)) return unit;
  const std::string small = in_small_letters(text);
  const ColumnUnit* unit = unit_spelt(small);
  return unit ? unit : unit_named(small);
}

UnitName split_unit(const std::string& column) {
  const std::size_t open = column.find_last_of("[(");
  const bool closed = !column.empty() && (column.back() == ']' || column.back() == ')');
  if (closed && open != std::string::npos) {
    const std::string name = trimmed(column.substr(0, open));
    const std::string unit = trimmed(column.substr(open + 1, column.size() - open - 2));
    const bool index = unit.find_first_not_of("0123456789 ") == std::string::npos;
    if (!name.empty() && !index && unit.find_first_of("[]()") == std::string::npos) return {name, unit};
    return {column, ""};
  }
  const std::size_t line = column.rfind('_');
  if (line == std::string::npos || line == 0 || !suffixes.contains(in_small_letters(column.substr(line + 1))))
    return {column, ""};
  return {column.substr(0, line), column.substr(line + 1)};
}

}  // namespace kr5::io
