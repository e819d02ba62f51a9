// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/read_log.hpp>

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>
#include <tuple>

#include <kr5/arm_log/column_words.hpp>
#include <kr5/arm_log/time_unit.hpp>
#include <kr5/core/error.hpp>
#include <kr5/io/column_unit.hpp>

namespace kr5::arm_log {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Where a part of a name stands in it.
struct NamePart {
  std::string text;  ///< In small letters.
  std::size_t begin = 0, end = 0;
};

/// The parts of a name between separators; digits are parts of their own.
std::vector<NamePart> name_parts(const std::string& name) {
  std::vector<NamePart> out;
  const auto is_digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  for (std::size_t at = 0; at < name.size(); ++at) {
    const auto c = static_cast<unsigned char>(name[at]);
    if (std::isalnum(c) == 0) continue;
    const bool goes_on = !out.empty() && out.back().end == at && is_digit(name[at]) == is_digit(name[at - 1]);
    if (!goes_on) out.push_back({"", at, at});
    out.back().text += static_cast<char>(std::tolower(c));
    out.back().end = at + 1;
  }
  return out;
}

/// A name with `#` for what stands between two places.
std::string stem_of(const std::string& name, std::size_t begin, std::size_t end) {
  return name.substr(0, begin) + "#" + name.substr(end);
}

/// The stem of a name that holds that of a joint; nothing where it is not in it.
std::optional<std::string> stem_of_joint(const std::string& name, const std::string& joint) {
  const std::vector<NamePart> parts = name_parts(name), own = name_parts(joint);
  const auto same = [](const NamePart& a, const NamePart& b) { return a.text == b.text; };
  const auto found = std::search(parts.begin(), parts.end(), own.begin(), own.end(), same);
  if (own.empty() || found == parts.end()) return std::nullopt;
  return stem_of(name, found->begin, (found + std::ssize(own) - 1)->end);
}

/// Columns of one stem by their joints (from 0), or by the numbers in them.
struct StemColumns {
  std::string stem;
  bool named = false;
  std::map<std::size_t, std::string> columns;
};

void add(std::vector<StemColumns>& to, const std::string& stem, bool named, std::size_t key,
         const std::string& column) {
  auto at = std::ranges::find_if(to, [&](const StemColumns& s) { return s.stem == stem && s.named == named; });
  if (at == to.end()) at = to.insert(to.end(), {stem, named, {}});
  at->columns.emplace(key, column);
}

/// All columns by their stems; what names no joint of the model goes by the last number in it.
std::vector<StemColumns> columns_by_stem(const std::vector<std::string>& names,
                                         const std::vector<std::string>& joints) {
  constexpr std::size_t most_digits = 3;
  std::vector<StemColumns> out;
  for (const std::string& column : names) {
    const std::string name = io::split_unit(column).name;
    std::size_t longest = 0, owner = joints.size();
    std::string stem;
    for (std::size_t k = 0; k < joints.size(); ++k)  // the longest name: elbow_joint_2 is not elbow_joint
      if (const auto own = stem_of_joint(name, joints[k]); own && joints[k].size() > longest)
        longest = joints[k].size(), owner = k, stem = *own;
    if (owner < joints.size()) add(out, stem, true, owner, column);
    const std::size_t last = name.find_last_of("0123456789");
    if (last == std::string::npos) continue;
    const std::size_t before = name.find_last_not_of("0123456789", last);
    const std::size_t first = before == std::string::npos ? 0 : before + 1;
    if (last + 1 - first <= most_digits)
      add(out, stem_of(name, first, last + 1), false, std::stoul(name.substr(first, last + 1 - first)), column);
  }
  return out;
}

/// Columns of a quantity: a name a joint, empty where there is none.
using FoundNames = std::vector<std::string>;

bool complete(const FoundNames& found) {
  return !found.empty() && std::ranges::none_of(found, [](const std::string& name) { return name.empty(); });
}

/// The columns of a stem in the order of the joints; numbers count from 1 or from 0.
FoundNames in_order(const StemColumns& of, std::size_t joints) {
  const auto counted_from = [&](std::size_t first) {
    FoundNames out(joints);
    for (std::size_t k = 0; k < joints; ++k)
      if (const auto at = of.columns.find(k + first); at != of.columns.end()) out[k] = at->second;
    return out;
  };
  if (of.named) return counted_from(0);
  FoundNames from_one = counted_from(1);
  return complete(from_one) ? from_one : counted_from(0);
}

/// Of several stems of a quantity the one that is used, as kr5.logs chooses: states of joints before those of
/// controllers, and these before what a controller puts out; names before numbers; short before long.
std::tuple<bool, bool, bool, std::size_t> preference(const StemColumns& of) {
  const std::vector<std::string> words = words_of(of.stem);
  const auto has = [&](const char* word) { return std::ranges::count(words, word) > 0; };
  return {!of.named, has("controller"), has("output"), of.stem.size()};
}

/// Those of the best stem that has one for every joint; else those of the joints that one names most of.
FoundNames columns_of(const std::vector<std::string>& names, const cell::Cell& cell, ColumnFamily family) {
  const auto joints = static_cast<std::size_t>(cell.robot.joints());
  std::vector<StemColumns> stems = columns_by_stem(names, cell.robot.joint_names);
  std::erase_if(stems, [&](const StemColumns& of) { return family_of(of.stem) != family || on_motor_side(of.stem); });
  std::ranges::stable_sort(stems, {}, preference);
  FoundNames most;
  std::ptrdiff_t held = 0;
  for (const StemColumns& of : stems) {
    FoundNames found = in_order(of, joints);
    if (complete(found)) return found;
    const std::ptrdiff_t count = std::ranges::count_if(found, [](const std::string& name) { return !name.empty(); });
    if (of.named && count > held) held = count, most = std::move(found);
  }
  return most;
}

/// What the columns of a family are called, and the quantities that they may have.
struct FamilyMeaning {
  const char* name;
  std::vector<std::string> quantities;
};

const FamilyMeaning& meaning_of_family(ColumnFamily family) {
  static const FamilyMeaning positions{"positions", {"angle", "length"}}, commands{"commands", {"angle", "length"}},
      efforts{"efforts", {"torque", "force"}}, currents{"currents", {"current"}};
  switch (family) {
    case ColumnFamily::Command:
      return commands;
    case ColumnFamily::Effort:
      return efforts;
    case ColumnFamily::Current:
      return currents;
    default:
      return positions;
  }
}

/// Factor to SI of the unit that a column states; 1 where it states none.
double stated_factor(const std::string& column, ColumnFamily family) {
  constexpr const char* with_own_zero = "tick";
  const io::UnitName split = io::split_unit(column);
  const std::string stated = split.unit.empty() ? unit_in(split.name) : split.unit;
  if (stated.empty()) return 1.0;
  const std::vector<std::string>& quantities = meaning_of_family(family).quantities;
  const auto fits = [&](const io::ColumnUnit& unit) {
    return unit.name != with_own_zero && std::ranges::count(quantities, unit.quantity) > 0;
  };
  if (const io::ColumnUnit* unit = io::find_unit(stated); unit && fits(*unit)) return unit->factor;
  std::string expected;
  for (const io::ColumnUnit& unit : io::column_units())
    if (fits(unit)) expected += (expected.empty() ? "" : ", ") + unit.name;
  throw InvalidArgument("column '" + column + "': found the unit '" + stated + "', expected one of " + expected);
}

std::string listed_names(const std::vector<std::string>& names) {
  constexpr std::size_t most = 12;
  std::string out;
  for (std::size_t k = 0; k < std::min(names.size(), most); ++k) out += (k > 0 ? ", " : "") + names[k];
  return out + (names.size() > most ? " and " + std::to_string(names.size() - most) + " more" : "");
}

std::string lacking_joints(const FoundNames& found, const cell::Cell& cell) {
  std::string out;
  for (std::size_t k = 0; k < found.size(); ++k)
    if (found[k].empty()) out += (out.empty() ? "" : ", ") + cell.robot.joint_names.at(k);
  return out;
}

/// Found names where all joints have one; none otherwise. `needed`: some joints without are an error.
FoundNames usable(const FoundNames& found, const std::vector<std::string>& names, const cell::Cell& cell,
                  ColumnFamily family, bool needed) {
  const std::string what = meaning_of_family(family).name;
  if (complete(found)) {
    for (const std::string& column : found) stated_factor(column, family);  // says which unit cannot be
    return found;
  }
  if (needed && !found.empty())
    throw InvalidArgument("found " + what + " of some joints, but not of " + lacking_joints(found, cell) +
                          "; expected those of every joint of the model");
  if (needed)
    throw InvalidArgument(
        "found no " + what + " of the " + std::to_string(cell.robot.joints()) +
        " joints, by their names or counted (q1, position_1, ...), among " + listed_names(names) +
        (cell.robot.joint_names.empty() ? std::string() : "; the model names " + listed_names(cell.robot.joint_names)));
  return {};
}

/// The first column that names a time; whole seconds, whose fraction stands in a column of its own, after all others.
std::string time_column(const std::vector<std::string>& names) {
  const auto whole = [](const std::string& name) { return name.ends_with("sec"); };
  const std::string* found = nullptr;
  for (const std::string& name : names)
    if (names_time(name) && (!found || (whole(*found) && !whole(name)))) found = &name;
  if (found) return *found;
  throw InvalidArgument("found no column of the time (t, time, timestamp, ...) among " + listed_names(names));
}

/// Seconds of a unit of the stamps of a column: the one that it states, else the one that they tell.
double seconds_of(const std::string& column, const VectorXd& stamps) {
  if (const std::string unit = time_unit_in(column); !unit.empty()) return io::find_unit(unit)->factor;
  require(!counts_rows(stamps), "column '" + column +
                                    "' counts rows, which is no time; expected stamps, or the unit "
                                    "of the count in its name, as in time_ms");
  return seconds_in(guess_time_unit(stamps));
}

MatrixXd values_of(const io::Table& table, const std::vector<std::string>& columns, ColumnFamily family) {
  MatrixXd out(columns.empty() ? 0 : table.values.rows(), static_cast<Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k)
    out.col(static_cast<Index>(k)) = stated_factor(columns[k], family) * table.column(columns[k]);
  return out;
}

}  // namespace

LogColumns find_columns(const std::vector<std::string>& names, const cell::Cell& cell, const LogColumns& given) {
  LogColumns out = given;
  if (out.time.empty()) out.time = time_column(names);
  const auto find = [&](std::vector<std::string>& columns, ColumnFamily family, bool needed) {
    if (columns.empty()) columns = usable(columns_of(names, cell, family), names, cell, family, needed);
  };
  find(out.command, ColumnFamily::Command, false);
  find(out.q, ColumnFamily::Position, out.command.empty());
  find(out.effort, ColumnFamily::Effort, false);
  find(out.current, ColumnFamily::Current, out.effort.empty());
  return out;
}

ArmLog log_of(const io::Table& table, const cell::Cell& cell, const LogColumns& columns) {
  const LogColumns found = find_columns(table.columns, cell, columns);
  const VectorXd stamps = table.column(found.time);
  ArmLog out;
  // Times count from the first: stamps since 1970 in small units would lose their last digits.
  out.t = seconds_of(found.time, stamps) * (stamps.array() - (stamps.size() > 0 ? stamps[0] : 0.0));
  out.q = values_of(table, found.q, ColumnFamily::Position);
  out.command = values_of(table, found.command, ColumnFamily::Command);
  out.effort = values_of(table, found.effort, ColumnFamily::Effort);
  out.current = values_of(table, found.current, ColumnFamily::Current);
  out.validate(cell.robot.joints());
  return out;
}

ArmLog read_log(const std::filesystem::path& file, const cell::Cell& cell, const LogColumns& columns) {
  const io::Table table = io::load_csv(file);
  try {
    return log_of(table, cell, columns);
  } catch (const InvalidArgument& error) {
    throw InvalidArgument(file.string() + ": " + error.what());
  }
}

}  // namespace kr5::arm_log
