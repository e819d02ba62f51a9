// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/gap/words.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>

#include "gap/wording/number_text.hpp"

namespace kr5::gap {
namespace {

constexpr double degrees_per_radian = 57.3;  // of an uncertainty

/// The column of a group such as `motion.i3`; null for one that no kind has.
const cell::Column* column_of(const std::string& group) {
  const auto [of_kind, column] = split_group(group);
  for (const auto& [kind, name] : enum_names(cell::Kind{}))
    if (name == of_kind) try {
        return &cell::find_column(kind, column);
      } catch (const InvalidArgument&) {
        return nullptr;
      }
  return nullptr;
}

/// The column of an effect's target that is a component of the wrench; null for any other target.
const cell::Column* wrench_component(const std::string& target) {
  const cell::Column* column = column_of("motion." + target);
  return column && column->group == "wrench" ? column : nullptr;
}

/// `joint3` is joint 3.
std::string numbered_text(const std::string& name) {
  const auto [word, number] = split_number(name);
  return number > 0 ? word + " " + std::to_string(number) : name;
}

bool is_joint(const std::string& target) { return target.starts_with("joint") || target.starts_with("motor"); }

/// The label of an effect; of one that no catalogue has its name.
std::string label_of(const std::string& effect) {
  try {
    return cell::find_effect(effect).label;
  } catch (const InvalidArgument&) {
    std::string out = effect;
    std::replace(out.begin(), out.end(), '_', ' ');
    return out;
  }
}

/// Whether a label of an effect leaves open on what it sits.
bool leaves_target_open(const std::string& label, const std::string& target) {
  static const std::set<std::string> only_one = {"drives", "links", "base", "servo"};
  return label.find(target_text(target)) == std::string::npos && !only_one.contains(target);
}

/// The label of a column in a kind of experiment, or in any; its name where none has it.
std::string label_of_column(const std::string& column, const std::string& of_kind) {
  for (const auto& [kind, name] : enum_names(cell::Kind{}))
    if (of_kind.empty() || name == of_kind)
      if (const cell::Column* found = column_of(std::string(name) + "." + column)) return found->label;
  return column;
}

/// Whether a name of a joint in a description is but its number: `joint_3`, `A3`, `3`.
bool only_number(const std::string& name, int number) {
  const auto [word, own] = split_number(name);
  std::string plain;
  for (const char c : word)
    if (c != '_' && c != ' ') plain += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return own == number && (plain.empty() || plain == "joint" || plain == "a");
}

std::string pose_uncertainty(const std::vector<double>& std) {
  if (std.size() < 6) return "";
  return "± " + number_text(1e3 * *std::max_element(std.begin(), std.begin() + 3)) + " mm, ± " +
         number_text(degrees_per_radian * *std::max_element(std.begin() + 3, std.begin() + 6)) + " °";
}

}  // namespace

std::string kind_text(cell::Kind kind) {
  switch (kind) {
    case cell::Kind::Motion:
      return "free motion";
    case cell::Kind::Poses:
      return "measured poses";
    case cell::Kind::Views:
      return "views of the board";
    case cell::Kind::Scan:
      return "scans";
    case cell::Kind::Step:
      return "steps";
    case cell::Kind::Press:
      return "presses on the bench";
    case cell::Kind::Profile:
      return "rolls of the peg on the tube";
  }
  return "";
}

std::string shown_by(cell::Kind kind) {
  switch (kind) {
    case cell::Kind::Motion:
      return "the joints, their drives and the force sensor";
    case cell::Kind::Poses:
      return "the geometry of the arm and the tool";
    case cell::Kind::Views:
      return "the geometry of the arm and the camera";
    case cell::Kind::Scan:
      return "the geometry of the arm and the line scanner";
    case cell::Kind::Step:
      return "the path correction";
    case cell::Kind::Press:
      return "the contact, the path correction and the force sensor";
    case cell::Kind::Profile:
      return "the contact of peg and tube and the force sensor";
  }
  return "";
}

std::pair<std::string, std::string> split_group(const std::string& group) {
  const std::size_t dot = group.find('.');
  return dot == std::string::npos ? std::pair(group, std::string())
                                  : std::pair(group.substr(0, dot), group.substr(dot + 1));
}

std::string column_text(const std::string& group) {
  const cell::Column* column = column_of(group);
  return column ? column->label : group;
}

std::string variable_text(const Variable& variable, const std::string& kind) {
  const std::string joint = "joint " + std::to_string(variable.joint);
  switch (variable.kind) {
    case VariableKind::None:
      return "";
    case VariableKind::Column:
      return label_of_column(variable.column, kind);
    case VariableKind::JointPosition:
      return "position of " + joint;
    case VariableKind::JointVelocity:
      return "velocity of " + joint;
    case VariableKind::JointSpeed:
      return "speed of " + joint;
    case VariableKind::JointAcceleration:
      return "acceleration of " + joint;
    case VariableKind::PathVelocity:
      return "commanded vertical speed";
    case VariableKind::Prediction:
      return "simulated " + label_of_column(variable.column, kind);
    case VariableKind::Experiment:
      return "experiment";
    case VariableKind::ExperimentKind:
      return "kind of experiment";
    case VariableKind::WhichColumn:
      return "column";
  }
  return "";
}

std::string part_of(const std::string& group) {
  const cell::Column* column = column_of(group);
  if (!column) return group;
  return wrench_component(column->target) ? "sensor" : column->target;
}

std::string part_text(const std::string& part) {
  static const std::map<std::string, std::string> parts = {
      {"sensor", "force sensor"},   {"tool", "tool"},
      {"camera", "camera"},         {"laser", "scanner"},
      {"servo", "path correction"}, {"contact", "contact with the bench"},
      {"tube", "peg on the tube"}};
  const auto found = parts.find(part);
  return found == parts.end() ? numbered_text(part) : found->second;
}

std::string target_text(const std::string& target) {
  static const std::map<std::string, std::string> targets = {
      {"force_torque", "force sensor"}, {"servo", "path correction"}, {"laser", "scanner"}};
  if (const cell::Column* column = wrench_component(target)) return column->component;
  const auto found = targets.find(target);
  return found == targets.end() ? numbered_text(target) : found->second;
}

std::string effect_text(const EffectName& name) {
  const std::string label = label_of(name.effect), target = target_text(name.target);
  if (!leaves_target_open(label, name.target)) return label;
  return is_joint(name.target) ? label + " of " + target : label + " (" + target + ")";
}

std::string effects_text(const std::string& effect, const std::vector<std::string>& targets) {
  if (targets.empty()) return label_of(effect);
  const std::string label = label_of(effect), word = split_number(targets[0]).first;
  const bool numbered = std::ranges::all_of(targets, [&](const std::string& target) {
    return is_joint(target) && split_number(target).first == word && split_number(target).second > 0;
  });
  if (targets.size() > 1 && numbered && leaves_target_open(label, targets[0])) {
    std::vector<std::string> numbers;
    for (const std::string& target : targets) numbers.push_back(std::to_string(split_number(target).second));
    return label + " of " + word + "s " + join_list(numbers);
  }
  std::vector<std::string> each;
  for (const std::string& target : targets) each.push_back(effect_text({effect, target}));
  return join_list(each);
}

std::pair<double, std::string> display_unit(const std::string& unit, const std::vector<double>& values,
                                            const std::string& target) {
  const std::string either = " or ";
  std::string own = unit;
  if (const cell::Column* component = wrench_component(target); component && unit.find(either) != std::string::npos) {
    own = "-";
    for (const std::string& name : {component->unit, component->unit + "/s"})
      for (std::size_t from = 0, to = 0; to != std::string::npos; from = to + either.size()) {
        to = unit.find(either, from);
        std::string part = unit.substr(from, to == std::string::npos ? to : to - from);
        std::string plain = part;
        std::replace(plain.begin(), plain.end(), '.', ' ');
        if (plain == name) own = std::move(part);
      }
  }
  const double largest = std::accumulate(values.begin(), values.end(), 0.0,
                                         [](double most, double x) { return std::max(most, std::abs(x)); });
  return text_unit(own, largest);
}

std::string value_text(const ParameterEstimate& parameter, const std::string& target) {
  constexpr std::size_t pose = 16;
  const std::vector<double>&value = parameter.value, &std = parameter.std;
  if (value.size() == pose) return pose_uncertainty(std);
  const auto [factor, unit] = display_unit(parameter.unit, value, target);
  std::vector<std::string> texts, errors;
  for (std::size_t k = 0; k < std::min(value.size(), std.size()); ++k) {
    const double v = factor * value[k], s = factor * std[k];
    texts.push_back(s == 0.0 ? format("%.6g", v) : number_text(v, s));
    errors.push_back(s == 0.0 ? "" : " ± " + number_text(s, s));
  }
  const bool common = std::set<std::string>(errors.begin(), errors.end()).size() == 1;
  std::string out;
  for (std::size_t k = 0; k < texts.size(); ++k) out += (k ? ", " : "") + texts[k] + (common ? "" : errors[k]);
  return out + (common ? errors[0] : "") + (unit.empty() ? "" : " " + unit);
}

std::string joint_name(const std::vector<std::string>& joint_names, const std::string& target) {
  const auto [word, number] = split_number(target);
  if (word != "joint" || number < 1 || static_cast<std::size_t>(number) > joint_names.size()) return "";
  const std::string& name = joint_names[static_cast<std::size_t>(number) - 1];
  return only_number(name, number) ? "" : name;
}

std::string clock_text(const ClockFault& fault) {
  static const std::map<std::string, std::string> groups = {
      {"torques", "joint torques"}, {"currents", "motor currents"}, {"positions", "joint angles"}};
  if (const auto found = groups.find(fault.group); found != groups.end()) return found->second;
  const bool motion = std::ranges::count(fault.kinds, cell::Kind::Motion) > 0;
  return fault.group + (fault.kinds.size() == 1 && motion ? " of motion" : motion ? "" : " of contact");
}

}  // namespace kr5::gap
