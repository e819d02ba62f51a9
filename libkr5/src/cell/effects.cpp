// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/effects.hpp>

#include <kr5/core/error.hpp>
#include <kr5/io/form.hpp>

#include "cell/effect_rows.hpp"

namespace kr5::cell {
namespace {

using io::Node;

/// `source` of ft_crosstalk may be a name, `element` of wrist_coupling a pair [row, column]; both become a number.
Node plain_number(const EffectRow& row, const std::string& parameter, int index, const Node& node) {
  Node out = node;
  if (parameter == "source" && node.kind == Node::Kind::Scalar) {
    const int component = target_index(row.effect.target, node.scalar);
    if (component >= 0) out.scalar = std::to_string(component);
  }
  if (parameter == "element" && node.items.size() == 2 && node.items[0].scalar == std::to_string(index)) {
    out = node.items[1];
    out.line = node.line;
  }
  return out;
}

void read_parameter(io::Reader& reader, const Node& node, const std::string& field, const Slot& slot) {
  std::visit(
      [&](auto* at) {
        if constexpr (std::is_same_v<decltype(at), Eigen::Vector3d*>) {
          if (node.kind == Node::Kind::Sequence && node.items.size() == 2) {  // tube_shift in the plane
            Eigen::Vector2d xy;
            if (reader.read(node, field, xy)) *at << xy, 0.0;
            return;
          }
        }
        reader.read(node, field, *at);
      },
      slot);
}

void read_target(io::Reader& reader, const Node& node, const std::string& field, const EffectRow& row, int index,
                 Effects& effects) {
  if (node.kind != Node::Kind::Map) return reader.problem(node, field, "a map of parameter: value");
  std::vector<std::string> known;
  bool any = false;
  for (std::size_t p = 0; p < row.slots.size(); ++p) {
    const EffectParameter& parameter = row.effect.parameters[p];
    known.push_back(parameter.name);
    const std::string path = field + "." + parameter.name;
    if (const Node* entry = node.find(parameter.name)) {
      any = true;
      read_parameter(reader, plain_number(row, parameter.name, index, *entry), path,
                     row.slots[p].write(effects, index));
    } else if (parameter.required) {
      reader.missing(node, path, "this parameter, without it the effect is not defined");
    }
  }
  reader.report_unknown(node, field, known);
  if (!any) reader.problem(node, field, "at least one parameter");
}

Node value_node(const EffectParameter& parameter, const EffectValue& value) {
  if (const auto* T = std::get_if<Pose>(&value)) return io::pose_node(*T);
  if (const auto* v = std::get_if<Eigen::VectorXd>(&value)) return io::to_node(*v);
  const double number = std::get<double>(value);
  return parameter.kind == EffectValueKind::Whole ? io::to_node(static_cast<int>(number)) : io::to_node(number);
}

}  // namespace

const JointEffects& Effects::joint(int index) const {
  static const JointEffects none;
  const auto i = static_cast<std::size_t>(index);
  return i < joints.size() ? joints[i] : none;
}

const MotorEffects& Effects::motor(int index) const {
  static const MotorEffects none;
  const auto i = static_cast<std::size_t>(index);
  return i < motors.size() ? motors[i] : none;
}

bool Effects::read_form(io::Reader& reader, const Node& node, const std::string& field) {
  if (node.kind != Node::Kind::Map && node.kind != Node::Kind::Null)
    return reader.problem(node, field, "a map of effect: target: parameter: value"), false;
  const std::size_t before = reader.problems().size();
  std::vector<std::string> known;
  for (const EffectRow& row : effect_rows()) known.push_back(row.effect.id);
  reader.report_unknown(node, field, known);
  for (const auto& [id, targets] : node.entries) {
    const EffectRow* row = find_row(id);
    const std::string path = io::Reader::join(field, id);
    if (!row) continue;
    if (targets.kind != Node::Kind::Map) reader.problem(targets, path, "a map of target: parameter: value");
    for (const auto& [target, parameters] : targets.entries) {
      const int index = target_index(row->effect.target, target);
      if (index < 0)
        reader.problem(parameters, path + "." + target, "on " + target_text(row->effect.target) + " only");
      else
        read_target(reader, parameters, path + "." + target, *row, index, *this);
    }
  }
  return reader.problems().size() == before;
}

Node Effects::write_form() const {
  Node out;
  out.kind = Node::Kind::Map;
  for (const ActiveEffect& active : active_effects(*this)) {
    Node& target = out[active.id][active.target];
    target.kind = Node::Kind::Map;
    target.flow = true;
    const Effect& effect = find_effect(active.id);
    for (const EffectParameter& parameter : effect.parameters)
      for (const auto& [name, value] : active.parameters)
        if (name == parameter.name) target.entries.emplace_back(name, value_node(parameter, value));
  }
  return out;
}

}  // namespace kr5::cell
