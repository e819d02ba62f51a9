// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/effect.hpp>

#include <algorithm>
#include <cmath>

#include <kr5/cell/cell.hpp>
#include <kr5/core/error.hpp>

#include "cell/check/diagnostic_collector.hpp"
#include "cell/effect_rows.hpp"

namespace kr5::cell {
namespace {

bool cell_has(const Cell& cell, EffectTarget kind) {
  using enum EffectTarget;
  switch (kind) {
    case Motor:
    case Drives:
      return cell.drives.has_value();
    case Servo:
      return cell.servo.has_value();
    case Tool:
    case WrenchComponent:
    case ForceTorque:
      return cell.tool.has_value();
    case Camera:
      return cell.camera.has_value();
    case Laser:
      return cell.laser.has_value();
    case Contact:
    case Gripper:
      return cell.contact.has_value();
    case Tube:
      return cell.tube.has_value();
    case Joint:
    case Base:
    case Links:
      return true;
  }
  return false;
}

/// What a parameter holds: the value that was set, or what switches it off; nothing for one that is as in the cell.
std::optional<EffectValue> held_value(const EffectEntry& entry, const EffectParameter& p) {
  for (const auto& [name, value] : entry.values)
    if (name == p.name) return value;
  if (p.nominal_when_off) return std::nullopt;
  if (p.off.size() == 1) return EffectValue(p.off.front());
  return EffectValue(
      Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(p.off.data(), static_cast<Eigen::Index>(p.off.size()))));
}

/// Whether a value differs from the one that switches the parameter off.
bool differs(const std::optional<EffectValue>& value, const EffectParameter& p) {
  if (!value || p.nominal_when_off) return value.has_value();
  if (const auto* x = std::get_if<double>(&*value)) return p.off.size() != 1 || *x != p.off.front();
  const auto* v = std::get_if<Eigen::VectorXd>(&*value);
  return v == nullptr || !std::equal(v->begin(), v->end(), p.off.begin(), p.off.end());
}

/// The effect as it acts; nothing where all of it is off, or a required value is missing.
std::optional<ActiveEffect> active_effect(const Effect& row, const EffectEntry& entry) {
  ActiveEffect out{row.id, target_name(row.target, entry.index), entry.index, {}};
  bool on = false;
  for (const EffectParameter& p : row.parameters) {
    const std::optional<EffectValue> value = held_value(entry, p);
    const bool changed = differs(value, p);
    on |= changed;
    if (!value && p.required) return std::nullopt;  // a coupling without its value means nothing
    if (value && (changed || p.required)) out.parameters.emplace_back(p.name, *value);
  }
  if (!on) return std::nullopt;
  return out;
}

}  // namespace

std::vector<Effect> effect_catalogue() { return {effect_rows().begin(), effect_rows().end()}; }

const Effect& find_effect(const std::string& id) { return required_row(id); }

bool Effect::periodic() const {
  return std::any_of(parameters.begin(), parameters.end(),
                     [](const EffectParameter& p) { return p.coordinate == CoordinateKind::Cycles; });
}

bool EffectParameter::measures_size() const {
  using enum CoordinateKind;
  return coordinate == Linear || coordinate == Ratio || coordinate == WholeCycles || coordinate == Mount ||
         coordinate == Amplitude;
}

double EffectSite::duration() const { return std::max(last_time - first_time, 1.0); }

std::optional<EffectValue> nominal_value(const Cell& cell, const std::string& id, const std::string& target,
                                         const std::string& parameter, int choice) {
  const Effect& row = required_row(id);
  const EffectParameter& p = required_parameter(row, parameter);
  const EffectSite at{cell, required_index(row, target), choice};
  if (p.nominal) return effect_possible(row, cell, target) ? p.nominal(at) : std::nullopt;
  const bool factor = p.measures_size() && p.off.size() == 1 && p.off[0] != 0.0 && std::isfinite(p.off[0]);
  return factor ? std::optional<EffectValue>(p.off[0]) : std::nullopt;
}

std::vector<std::string> effect_targets(const Effect& effect, const Cell& cell) {
  if (!cell_has(cell, effect.target)) return {};
  const int count = target_count(effect.target, cell);
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) names.push_back(target_name(effect.target, i));
  return names;
}

bool effect_possible(const Effect& effect, const Cell& cell, const std::string& target) {
  const std::vector<std::string> there = effect_targets(effect, cell);
  if (std::find(there.begin(), there.end(), target) == there.end()) return false;
  return !effect.needs.there || effect.needs.there(cell);
}

std::string lacking_part(const Effect& effect, const Cell& cell) {
  if (effect_targets(effect, cell).empty()) {
    std::string kind(name_of(effect.target));
    std::replace(kind.begin(), kind.end(), '_', ' ');
    return kind;
  }
  return effect.needs.there && !effect.needs.there(cell) ? effect.needs.part : "";
}

bool part_replaced(const Effect& effect, const Cell& cell) {
  return !lacking_part(effect, cell).empty() && effect.needs.replaced && effect.needs.replaced(cell);
}

std::optional<EffectValue> get_effect(const Effects& effects, const std::string& id, const std::string& target,
                                      const std::string& parameter) {
  const Effect& row = required_row(id);
  const EffectParameter& p = required_parameter(row, parameter);
  EffectEntry entry{id, required_index(row, target), {}};
  if (const EffectValue* value = effects.find(id, parameter, entry.index)) entry.values.emplace_back(parameter, *value);
  return held_value(entry, p);
}

void set_effect(Cell& cell, const std::string& id, const std::string& target, const std::string& parameter,
                const std::optional<EffectValue>& value) {
  const Effect& row = required_row(id);
  required_parameter(row, parameter);
  const int index = required_index(row, target);
  const std::vector<std::string> there = effect_targets(row, cell);
  require(!there.empty(),
          "the effect '" + id + "' sits on " + target_text(row.target) + ", which this cell does not have");
  require(index < static_cast<int>(there.size()),
          "this cell has no " + target + " for the effect '" + id + "'; it has " + listed(there));
  cell.effects.set(id, target, parameter, value);
}

double ActiveEffect::number(const std::string& parameter) const {
  for (const auto& [name, value] : parameters)
    if (name == parameter && std::holds_alternative<double>(value)) return std::get<double>(value);
  throw InvalidArgument("effects." + id + "." + target + " has no number '" + parameter + "'");
}

namespace {

void add_active(const Effect& row, const Effects& effects, std::vector<ActiveEffect>& out) {
  std::vector<const EffectEntry*> entries;
  for (const EffectEntry& entry : effects.entries())
    if (entry.effect == row.id) entries.push_back(&entry);
  std::sort(entries.begin(), entries.end(), [](const auto* a, const auto* b) { return a->index < b->index; });
  for (const EffectEntry* entry : entries)
    if (auto active = active_effect(row, *entry)) out.push_back(std::move(*active));
}

}  // namespace

std::vector<ActiveEffect> active_effects(const Effects& effects) {
  std::vector<ActiveEffect> out;
  if (effects.entries().empty()) return out;
  for (const Effect& row : effect_rows()) add_active(row, effects, out);
  return out;
}

std::vector<ActiveEffect> registered_active_effects(const Effects& effects) {
  std::vector<ActiveEffect> out;
  if (effects.entries().empty()) return out;
  for (const Effect& row : effect_rows())
    if (row.change_cell || row.change_columns) add_active(row, effects, out);
  return out;
}

}  // namespace kr5::cell
