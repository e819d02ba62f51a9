// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/read_log.hpp>

#include <algorithm>
#include <cctype>
#include <map>
#include <numbers>
#include <optional>
#include <set>

#include <kr5/core/error.hpp>

namespace kr5::arm_log {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// What the columns of a joint may show.
enum class Quantity { None, Position, Command, Effort, Current };

using Words = std::set<std::string>;

/// Words of a name, after its joint and unit were taken out.
const Words time_words = {"t", "time", "timestamp", "stamp", "clock"};
const Words position_words = {"q", "pos", "position", "positions", "angle", "angles", "joint", "axis", "j"};
const Words command_words = {"qc",     "cmd",       "command", "commanded", "commands",  "des",  "desired",
                             "target", "reference", "ref",     "setpoint",  "setpoints", "goal", "soll"};
const Words effort_words = {"tau", "torque", "torques", "effort", "efforts", "trq", "force", "forces"};
const Words current_words = {"i", "cur", "current", "currents", "amps"};
/// Columns with one of these are none of them.
const Words other_words = {"qd",           "dq",  "vel",     "velocity", "velocities", "speed",       "acc",
                           "acceleration", "qdd", "ddq",     "error",    "ext",        "temperature", "std",
                           "min",          "max", "voltage", "motor",    "stamp",      "limit"};

bool has_one_of(const std::vector<std::string>& parts, const Words& words) {
  return std::any_of(parts.begin(), parts.end(), [&](const std::string& part) { return words.count(part) > 0; });
}

Quantity quantity_of(const std::vector<std::string>& parts) {
  if (has_one_of(parts, other_words)) return Quantity::None;
  const bool command = has_one_of(parts, command_words);
  if (has_one_of(parts, effort_words)) return command ? Quantity::None : Quantity::Effort;
  if (has_one_of(parts, current_words)) return command ? Quantity::None : Quantity::Current;
  if (command) return Quantity::Command;
  return has_one_of(parts, position_words) ? Quantity::Position : Quantity::None;
}

/// Factors to SI of the units that stand in brackets at the end of a name, without spaces and in small letters.
const std::map<std::string, double> unit_factors = {{"rad", 1.0}, {"deg", std::numbers::pi / 180},
                                                    {"m", 1.0},   {"mm", 1e-3},
                                                    {"s", 1.0},   {"ms", 1e-3},
                                                    {"us", 1e-6}, {"ns", 1e-9},
                                                    {"a", 1.0},   {"ma", 1e-3},
                                                    {"n", 1.0},   {"nm", 1.0},
                                                    {"nmm", 1e-3}};
/// Those that also stand behind an underscore, where they are no name of a joint.
const Words plain_units = {"rad", "deg", "mm", "ms", "us", "ns", "ma", "nm", "nmm"};

/// The parts of a name between separators, in small letters; digits are parts of their own.
std::vector<std::string> name_parts(const std::string& name) {
  std::vector<std::string> out(1);
  bool number = false;
  for (const char letter : name) {
    const auto c = static_cast<unsigned char>(letter);
    if (!std::isalnum(c) || (!out.back().empty() && number != (std::isdigit(c) != 0))) out.emplace_back();
    if (!std::isalnum(c)) continue;
    number = std::isdigit(c) != 0;
    out.back() += static_cast<char>(std::tolower(c));
  }
  std::erase(out, "");
  return out;
}

/// A name without the unit that it ends in, and that unit's factor to SI.
struct SpokenName {
  std::vector<std::string> parts;
  double factor = 1.0;
};

SpokenName spoken(const std::string& name) {
  const std::size_t open = name.find_last_of("[(");
  if (open != std::string::npos && open > 0 && (name.back() == ']' || name.back() == ')')) {
    std::string unit;
    for (const char c : name.substr(open + 1, name.size() - open - 2))
      if (c != ' ') unit += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (const auto found = unit_factors.find(unit); found != unit_factors.end())
      return {name_parts(name.substr(0, open)), found->second};
    require(
        !unit.empty() && std::all_of(unit.begin(), unit.end(), [](unsigned char c) { return std::isdigit(c) != 0; }),
        "column '" + name + "': found the unit '" + unit +
            "', expected one of rad, deg, m, mm, s, ms, us, ns, A, "
            "mA, N, N m, N mm");
  }
  SpokenName out{name_parts(name)};
  if (out.parts.size() > 1 && plain_units.count(out.parts.back()) > 0) {
    out.factor = unit_factors.at(out.parts.back());
    out.parts.pop_back();
  }
  return out;
}

/// The parts of a name beside those of a joint; nothing where the joint is not in it.
std::optional<std::vector<std::string>> beside_joint(const std::vector<std::string>& parts, const std::string& joint) {
  const std::vector<std::string> own = name_parts(joint);
  const auto found = std::search(parts.begin(), parts.end(), own.begin(), own.end());
  if (own.empty() || found == parts.end()) return std::nullopt;
  std::vector<std::string> out(parts.begin(), found);
  out.insert(out.end(), found + static_cast<std::ptrdiff_t>(own.size()), parts.end());
  return out;
}

std::string words_for(Quantity quantity) {
  switch (quantity) {
    case Quantity::Position:
      return "positions";
    case Quantity::Command:
      return "commands";
    case Quantity::Effort:
      return "efforts";
    case Quantity::Current:
      return "currents";
    default:
      return "";
  }
}

/// Columns of a quantity: a name a joint, empty where there is none.
using FoundNames = std::vector<std::string>;

FoundNames by_joint_names(const std::vector<std::string>& names, const std::vector<std::string>& joints,
                          Quantity quantity) {
  FoundNames out(joints.size());
  for (const std::string& name : names) {
    std::size_t longest = 0, owner = joints.size();
    for (std::size_t k = 0; k < joints.size(); ++k) {  // the longest name: elbow_joint_2 is not elbow_joint
      const auto rest = beside_joint(spoken(name).parts, joints[k]);
      if (!rest || quantity_of(*rest) != quantity || joints[k].size() <= longest) continue;
      longest = joints[k].size(), owner = k;
    }
    if (owner < joints.size() && out[owner].empty()) out[owner] = name;
  }
  return out;
}

FoundNames by_numbers(const std::vector<std::string>& names, std::size_t joints, Quantity quantity, std::size_t first) {
  FoundNames out(joints);
  for (const std::string& name : names) {
    std::vector<std::string> parts = spoken(name).parts;
    if (parts.size() < 2 || !std::isdigit(static_cast<unsigned char>(parts.back().front())) || parts.back().size() > 3)
      continue;
    const std::size_t number = std::stoul(parts.back());
    parts.pop_back();
    if (number < first || number >= first + joints || quantity_of(parts) != quantity) continue;
    if (out[number - first].empty()) out[number - first] = name;
  }
  return out;
}

bool complete(const FoundNames& found) {
  return std::none_of(found.begin(), found.end(), [](const std::string& name) { return name.empty(); });
}

FoundNames columns_of(const std::vector<std::string>& names, const cell::Cell& cell, Quantity quantity) {
  const auto n = static_cast<std::size_t>(cell.robot.joints());
  FoundNames named;
  if (!cell.robot.joint_names.empty()) {
    named = by_joint_names(names, cell.robot.joint_names, quantity);
    if (complete(named)) return named;
  }
  for (const std::size_t first : {1, 0})
    if (const FoundNames counted = by_numbers(names, n, quantity, first); complete(counted)) return counted;
  return named;
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
                  Quantity quantity, bool needed) {
  if (!found.empty() && complete(found)) return found;
  const bool some = std::any_of(found.begin(), found.end(), [](const std::string& name) { return !name.empty(); });
  if (needed && some)
    throw InvalidArgument("found " + words_for(quantity) + " of some joints, but not of " +
                          lacking_joints(found, cell) + "; expected those of every joint of the model");
  if (needed)
    throw InvalidArgument(
        "found no " + words_for(quantity) + " of the " + std::to_string(cell.robot.joints()) +
        " joints, by their names or counted (q1, position_1, ...), among " + listed_names(names) +
        (cell.robot.joint_names.empty() ? std::string() : "; the model names " + listed_names(cell.robot.joint_names)));
  return {};
}

std::string time_column(const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    const std::vector<std::string> parts = spoken(name).parts;
    if (!parts.empty() && time_words.count(parts.back()) > 0) return name;
  }
  throw InvalidArgument("found no column of the time (t, time, timestamp, ...) among " + listed_names(names));
}

MatrixXd values_of(const io::Table& table, const std::vector<std::string>& columns) {
  MatrixXd out(columns.empty() ? 0 : table.values.rows(), static_cast<Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k)
    out.col(static_cast<Index>(k)) = spoken(columns[k]).factor * table.column(columns[k]);
  return out;
}

}  // namespace

LogColumns find_columns(const std::vector<std::string>& names, const cell::Cell& cell, const LogColumns& given) {
  LogColumns out = given;
  if (out.time.empty()) out.time = time_column(names);
  const auto find = [&](std::vector<std::string>& columns, Quantity quantity, bool needed) {
    if (columns.empty()) columns = usable(columns_of(names, cell, quantity), names, cell, quantity, needed);
  };
  find(out.command, Quantity::Command, false);
  find(out.q, Quantity::Position, out.command.empty());
  find(out.effort, Quantity::Effort, false);
  find(out.current, Quantity::Current, out.effort.empty());
  return out;
}

ArmLog log_of(const io::Table& table, const cell::Cell& cell, const LogColumns& columns) {
  const LogColumns found = find_columns(table.columns, cell, columns);
  const VectorXd stamps = table.column(found.time);
  ArmLog out;
  // Times count from the first: stamps since 1970 in small units would lose their last digits.
  out.t = spoken(found.time).factor * (stamps.array() - (stamps.size() > 0 ? stamps[0] : 0.0));
  out.q = values_of(table, found.q);
  out.command = values_of(table, found.command);
  out.effort = values_of(table, found.effort);
  out.current = values_of(table, found.current);
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
