// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/effect.hpp>
#include <kr5/io/fields.hpp>

#include "struct_binder.hpp"

/// @file
/// Effects are a nested dict in Python, as in a cell file: {effect: {target: {parameter: value}}}.

namespace kr5::python {

inline io::Node to_node(const py::handle& value) {
  using io::Node;
  Node node;
  if (value.is_none()) return node;
  if (py::isinstance<py::dict>(value)) {
    node.kind = Node::Kind::Map;
    for (const auto& [key, item] : py::reinterpret_borrow<py::dict>(value))
      node.entries.emplace_back(py::str(key).cast<std::string>(), to_node(item));
  } else if (py::isinstance<py::str>(value)) {
    node = Node::make_scalar(value.cast<std::string>());
  } else if (py::isinstance<py::int_>(value)) {
    node = Node::make_scalar(py::str(value).cast<std::string>());
  } else if (py::hasattr(value, "tolist")) {
    node = to_node(value.attr("tolist")());
  } else if (py::isinstance<py::sequence>(value)) {
    node.kind = Node::Kind::Sequence;
    for (const auto& item : value) node.items.push_back(to_node(item));
  } else {
    node = Node::make_scalar(cast_or_complain<double>(value, "effects"));
  }
  return node;
}

inline py::object effect_value(const std::optional<cell::EffectValue>& value, cell::EffectValueKind kind) {
  if (!value) return py::none();
  if (const auto* number = std::get_if<double>(&*value); number && kind == cell::EffectValueKind::Whole)
    return py::int_(static_cast<long>(*number));
  return std::visit([](const auto& v) { return py::object(py::cast(v)); }, *value);
}

inline cell::EffectValueKind kind_of(const cell::Effect& effect, const std::string& parameter) {
  for (const cell::EffectParameter& p : effect.parameters)
    if (p.name == parameter) return p.kind;
  return cell::EffectValueKind::Number;
}

/// The parameters of an active effect: {name: value}.
inline py::dict values_of(const cell::ActiveEffect& effect) {
  py::dict out;
  for (const auto& [name, value] : effect.parameters)
    out[py::str(name)] = effect_value(value, kind_of(cell::find_effect(effect.id), name));
  return out;
}

/// A Python value as a parameter takes it; what does not fit is complained about by set_effect.
inline std::optional<cell::EffectValue> effect_value(const py::handle& value) {
  if (value.is_none()) return std::nullopt;
  const auto array = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(value);
  if (!array) complain("value", "a number, a list of numbers, a 4x4 pose or None", value);
  if (array.ndim() == 0) return cell::EffectValue(*array.data());
  if (array.ndim() == 1) return cell::EffectValue(value.cast<Eigen::VectorXd>());
  return cell::EffectValue(value.cast<Pose>());
}

template <>
struct Convert<cell::Effects> {
  static std::string text() { return class_text<cell::Effects>(); }
  static std::string argument() { return text() + " | dict[str, typing.Any]"; }
  static py::object to_plain(const cell::Effects& effects) {
    py::dict out;
    for (const cell::ActiveEffect& active : cell::active_effects(effects)) {
      if (!out.contains(active.id)) out[py::str(active.id)] = py::dict();
      py::dict parameters;
      for (const auto& [name, value] : active.parameters) {
        const py::object item = effect_value(value, kind_of(cell::find_effect(active.id), name));
        parameters[py::str(name)] = py::hasattr(item, "tolist") ? py::object(item.attr("tolist")()) : item;
      }
      out[py::str(active.id)][py::str(active.target)] = parameters;
    }
    return out;
  }
  static cell::Effects from_python(const py::handle& value, const std::string& where) {
    if (!py::isinstance<py::dict>(value)) return cast_or_complain<cell::Effects>(value, where);
    cell::Effects effects;
    io::Reader reader(where);
    effects.from_node(reader, to_node(value), "");
    if (!reader.diagnostics().empty()) throw InvalidArgument(reader.diagnostics().front().text());
    return effects;
  }
};

}  // namespace kr5::python
