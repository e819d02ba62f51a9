// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/effects.hpp>

#include <algorithm>
#include <cmath>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/io/format.hpp>

#include "cell/effect_rows.hpp"

namespace kr5::cell {
namespace {

using io::Node;

const std::string scope = "effects.";

/// The row and parameter that a law asks for.
const EffectParameter& parameter_of(std::string_view effect, std::string_view parameter) {
  return required_parameter(required_row(effect), parameter);
}

template <class T>
const T& held(const EffectValue& value, std::string_view effect, std::string_view parameter) {
  const T* found = std::get_if<T>(&value);
  require(found != nullptr, scope + std::string(effect) + ": " + std::string(parameter) + " is of another form");
  return *found;
}

/// @throws InvalidArgument for a value that a parameter cannot hold.
void require_form(const EffectParameter& p, const EffectValue& value, const std::string& what) {
  using enum EffectValueKind;
  if (p.kind == Pose) return require(std::holds_alternative<kr5::Pose>(value), what + " is a pose");
  if (p.kind == Vector2 || p.kind == Vector3) {
    const Eigen::Index size = p.kind == Vector2 ? 2 : 3;
    const auto* v = std::get_if<Eigen::VectorXd>(&value);
    return require(v != nullptr && v->size() == size && v->allFinite(),
                   what + " is a list of " + std::to_string(size) + " finite numbers");
  }
  const double* x = std::get_if<double>(&value);
  require(x != nullptr, what + " is one number");
  require(!std::isnan(*x), what + " is NaN");
  require(p.kind != Whole || (*x == std::round(*x) && std::abs(*x) < 1e9), what + " is a whole number");
}

/// A number that counts targets may be the name of one (of a wrench component), or stand behind the number of the
/// target that carries the effect, as row and column of a matrix; both become a number.
Node plain_number(const EffectParameter& parameter, int index, const Node& node) {
  Node out = node;
  if (!parameter.refers_to) return out;
  if (node.kind == Node::Kind::Scalar) {
    const int named = target_index(*parameter.refers_to, node.scalar);
    if (named >= 0) out.scalar = std::to_string(named);
  } else if (node.items.size() == 2 && node.items[0].scalar == std::to_string(index)) {
    out = node.items[1];
    out.line = node.line;
  }
  return out;
}

std::optional<EffectValue> read_value(io::Reader& reader, const Node& node, const std::string& field,
                                      EffectValueKind kind) {
  const auto read = [&](auto value) -> std::optional<EffectValue> {
    if (!reader.read(node, field, value)) return std::nullopt;
    if constexpr (requires { value.rows(); })
      if constexpr (!std::is_same_v<decltype(value), kr5::Pose>) return EffectValue(Eigen::VectorXd(value));
    if constexpr (std::is_same_v<decltype(value), int>) return EffectValue(static_cast<double>(value));
    if constexpr (std::is_same_v<decltype(value), double> || std::is_same_v<decltype(value), kr5::Pose>)
      return EffectValue(value);
  };
  switch (kind) {
    case EffectValueKind::Number:
      return read(0.0);
    case EffectValueKind::Whole:
      return read(0);
    case EffectValueKind::Vector2:
      return read(Eigen::Vector2d(0, 0));
    case EffectValueKind::Vector3:
      if (node.kind == Node::Kind::Sequence && node.items.size() == 2) {  // in the plane
        Eigen::Vector2d xy;
        if (!reader.read(node, field, xy)) return std::nullopt;
        return EffectValue(Eigen::VectorXd(Eigen::Vector3d(xy.x(), xy.y(), 0.0)));
      }
      return read(Eigen::Vector3d(0, 0, 0));
    case EffectValueKind::Pose:
      return read(kr5::Pose(kr5::Pose::Identity()));
  }
  return std::nullopt;
}

void read_target(io::Reader& reader, const Node& node, const std::string& field, const Effect& row,
                 const std::string& target, Effects& effects) {
  if (node.kind != Node::Kind::Map) return reader.report(node, field, "a map of parameter: value");
  const int index = target_index(row.target, target);
  std::vector<std::string> known;
  bool any = false;
  for (const EffectParameter& parameter : row.parameters) {
    known.push_back(parameter.name);
    const std::string path = field + "." + parameter.name;
    if (const Node* entry = node.find(parameter.name)) {
      any = true;
      const auto value = read_value(reader, plain_number(parameter, index, *entry), path, parameter.kind);
      const double* number = value ? std::get_if<double>(&*value) : nullptr;
      if (number && std::isnan(*number))
        reader.report(*entry, path, "a number");
      else if (value)
        effects.set(row.id, target, parameter.name, value);
    } else if (parameter.required) {
      reader.report_missing(node, path, "this parameter, without it the effect is not defined");
    }
  }
  reader.report_unknown(node, field, known);
  if (!any) reader.report(node, field, "at least one parameter");
}

Node value_node(const EffectParameter& parameter, const EffectValue& value) {
  if (const auto* T = std::get_if<kr5::Pose>(&value)) return io::pose_node(*T);
  if (const auto* v = std::get_if<Eigen::VectorXd>(&value)) return io::to_node(*v);
  const double number = std::get<double>(value);
  return parameter.kind == EffectValueKind::Whole ? io::to_node(static_cast<int>(number)) : io::to_node(number);
}

}  // namespace

bool Effects::carries(std::string_view effect, int index) const {
  return std::any_of(entries_.begin(), entries_.end(),
                     [&](const EffectEntry& e) { return e.index == index && e.effect == effect; });
}

const EffectValue* Effects::find(std::string_view effect, std::string_view parameter, int index) const {
  for (const EffectEntry& e : entries_)
    if (e.index == index && e.effect == effect)
      for (const auto& [name, value] : e.values)
        if (name == parameter) return &value;
  return nullptr;
}

double Effects::number(std::string_view effect, std::string_view parameter, int index) const {
  if (const EffectValue* value = find(effect, parameter, index)) return held<double>(*value, effect, parameter);
  const EffectParameter& p = parameter_of(effect, parameter);
  require(p.off.size() == 1, scope + std::string(effect) + ": " + p.name + " has no off value that is one number");
  return p.off.front();
}

Eigen::VectorXd Effects::vector(std::string_view effect, std::string_view parameter, int index) const {
  if (const EffectValue* value = find(effect, parameter, index))
    return held<Eigen::VectorXd>(*value, effect, parameter);
  const EffectParameter& p = parameter_of(effect, parameter);
  return Eigen::Map<const Eigen::VectorXd>(p.off.data(), static_cast<Eigen::Index>(p.off.size()));
}

std::optional<double> Effects::replaced_number(std::string_view effect, std::string_view parameter, int index) const {
  const EffectValue* value = find(effect, parameter, index);
  return value ? std::optional<double>(held<double>(*value, effect, parameter)) : std::nullopt;
}

std::optional<Eigen::VectorXd> Effects::replaced_vector(std::string_view effect, std::string_view parameter,
                                                        int index) const {
  const EffectValue* value = find(effect, parameter, index);
  return value ? std::optional<Eigen::VectorXd>(held<Eigen::VectorXd>(*value, effect, parameter)) : std::nullopt;
}

std::optional<Pose> Effects::replaced_pose(std::string_view effect, std::string_view parameter, int index) const {
  const EffectValue* value = find(effect, parameter, index);
  return value ? std::optional<kr5::Pose>(held<kr5::Pose>(*value, effect, parameter)) : std::nullopt;
}

void Effects::set(const std::string& effect, const std::string& target, const std::string& parameter,
                  const std::optional<EffectValue>& value) {
  const Effect& row = find_effect(effect);
  const EffectParameter& p = required_parameter(row, parameter);
  const int index = required_index(row, target);
  if (value) require_form(p, *value, scope + effect + "." + target + "." + parameter);
  auto entry = std::find_if(entries_.begin(), entries_.end(),
                            [&](const EffectEntry& e) { return e.index == index && e.effect == effect; });
  if (entry == entries_.end()) {
    if (!value) return;
    entry = entries_.insert(entries_.end(), {effect, index, {}});
  }
  std::erase_if(entry->values, [&](const auto& held) { return held.first == parameter; });
  if (value) entry->values.emplace_back(parameter, *value);
  if (entry->values.empty()) entries_.erase(entry);
}

void Effects::remove(std::string_view effect) {
  std::erase_if(entries_, [&](const EffectEntry& e) { return e.effect == effect; });
}

bool Effects::from_node(io::Reader& reader, const Node& node, const std::string& field) {
  if (node.kind != Node::Kind::Map && node.kind != Node::Kind::Null)
    return reader.report(node, field, "a map of effect: target: parameter: value"), false;
  const std::size_t before = reader.diagnostics().size();
  std::vector<std::string> known;
  for (const Effect& row : effect_rows()) known.push_back(row.id);
  reader.report_unknown(node, field, known);
  for (const auto& [id, targets] : node.entries) {
    const Effect* row = find_row(id);
    const std::string path = io::Reader::join(field, id);
    if (!row) continue;
    if (targets.kind != Node::Kind::Map) reader.report(targets, path, "a map of target: parameter: value");
    for (const auto& [target, parameters] : targets.entries) {
      if (target_index(row->target, target) < 0)
        reader.report(parameters, path + "." + target, "on " + target_text(row->target) + " only");
      else
        read_target(reader, parameters, path + "." + target, *row, target, *this);
    }
  }
  return reader.diagnostics().size() == before;
}

Node Effects::to_node() const {
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
