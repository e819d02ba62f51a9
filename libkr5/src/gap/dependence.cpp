// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/gap/dependence.hpp>

#include <charconv>
#include <string_view>

namespace kr5::gap {
namespace {

constexpr std::string_view of_prediction = "predicted ";

/// Notation of a variable of a joint: what stands before and behind its number.
struct JointNotation {
  VariableKind kind;
  std::string_view before, behind;
};
constexpr JointNotation joint_notations[] = {{VariableKind::JointPosition, "q", ""},
                                             {VariableKind::JointVelocity, "qd", ""},
                                             {VariableKind::JointSpeed, "|qd", "|"},
                                             {VariableKind::JointAcceleration, "qdd", ""}};

struct PlainNotation {
  VariableKind kind;
  std::string_view text;
};
constexpr PlainNotation plain_notations[] = {{VariableKind::None, ""},
                                             {VariableKind::PathVelocity, "zcd"},
                                             {VariableKind::Experiment, "experiment"},
                                             {VariableKind::ExperimentKind, "kind of experiment"},
                                             {VariableKind::WhichColumn, "column"}};

/// Number of the joint in a notation; 0: it is another.
int joint_in(std::string_view text, const JointNotation& notation) {
  if (!text.starts_with(notation.before) || !text.ends_with(notation.behind)) return 0;
  if (text.size() <= notation.before.size() + notation.behind.size()) return 0;
  text.remove_prefix(notation.before.size());
  text.remove_suffix(notation.behind.size());
  int joint = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), joint);
  return error == std::errc{} && end == text.data() + text.size() && joint > 0 ? joint : 0;
}

}  // namespace

std::string symbol(const Variable& variable) {
  std::string out = variable.column;
  if (variable.kind == VariableKind::Prediction) out.insert(0, of_prediction);
  for (const PlainNotation& plain : plain_notations)
    if (plain.kind == variable.kind) out = plain.text;
  for (const JointNotation& of_joint : joint_notations)
    if (of_joint.kind == variable.kind)
      out = std::string(of_joint.before) + std::to_string(variable.joint) + std::string(of_joint.behind);
  return variable.experiment.empty() ? out : variable.experiment + " " + out;
}

Variable find_variable(const std::string& symbol) {
  for (const PlainNotation& plain : plain_notations)
    if (plain.text == symbol) return {plain.kind};
  for (const JointNotation& of_joint : joint_notations)
    if (const int joint = joint_in(symbol, of_joint)) return {of_joint.kind, joint};
  if (symbol.starts_with(of_prediction)) return {VariableKind::Prediction, 0, symbol.substr(of_prediction.size())};
  return {VariableKind::Column, 0, symbol};
}

}  // namespace kr5::gap
