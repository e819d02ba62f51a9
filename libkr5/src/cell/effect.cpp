// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/effect.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>

#include <kr5/cell/cell.hpp>
#include <kr5/core/error.hpp>
#include <kr5/io/problem.hpp>

#include "cell/complaints.hpp"
#include "cell/effect_rows.hpp"

namespace kr5::cell {
namespace {

constexpr std::array<const char*, 6> wrench_names = {"fx", "fy", "fz", "tx", "ty", "tz"};
constexpr int most_joints = 100;

const EffectRow& required_row(const std::string& id) {
  if (const EffectRow* row = find_row(id)) return *row;
  std::vector<std::string> known;
  for (const EffectRow& row : effect_rows()) known.push_back(row.effect.id);
  const std::string near = io::nearest_name(id, known);
  throw InvalidArgument("no effect '" + id + "'; " +
                        (near.empty() ? "there are " + listed(known) : "did you mean '" + near + "'?"));
}

const SlotAccess& required_slot(const EffectRow& row, const std::string& parameter) {
  std::vector<std::string> known;
  for (std::size_t i = 0; i < row.slots.size(); ++i) {
    known.push_back(row.effect.parameters[i].name);
    if (known.back() == parameter) return row.slots[i];
  }
  throw InvalidArgument("the effect '" + row.effect.id + "' has no parameter '" + parameter + "'; there are " +
                        listed(known));
}

int required_index(const EffectRow& row, const std::string& target) {
  const int index = target_index(row.effect.target, target);
  require(index >= 0,
          "the effect '" + row.effect.id + "' sits on " + target_text(row.effect.target) + ", found '" + target + "'");
  return index;
}

void write_slot(const Slot& slot, const std::optional<EffectValue>& value, const ConstSlot& off,
                const std::string& what) {
  const auto number = [&]() -> double {
    const auto* x = std::get_if<double>(&*value);
    require(x != nullptr, what + " is one number");
    require(!std::isnan(*x), what + " is NaN");
    return *x;
  };
  const auto vector = [&](Eigen::Index size) -> const Eigen::VectorXd& {
    const auto* v = std::get_if<Eigen::VectorXd>(&*value);
    require(v != nullptr && v->size() == size && v->allFinite(),
            what + " is a list of " + std::to_string(size) + " finite numbers");
    return *v;
  };
  if (!value) {
    std::visit(
        [&](auto* at) {
          *at = **std::get_if<std::add_pointer_t<std::add_const_t<std::remove_pointer_t<decltype(at)>>>>(&off);
        },
        slot);
  } else if (const auto* at = std::get_if<double*>(&slot)) {
    **at = number();
  } else if (const auto* maybe = std::get_if<std::optional<double>*>(&slot)) {
    **maybe = number();
  } else if (const auto* whole = std::get_if<int*>(&slot)) {
    require(number() == std::round(number()) && std::abs(number()) < 1e9, what + " is a whole number");
    **whole = static_cast<int>(number());
  } else if (const auto* v2 = std::get_if<Eigen::Vector2d*>(&slot)) {
    **v2 = vector(2);
  } else if (const auto* v3 = std::get_if<Eigen::Vector3d*>(&slot)) {
    **v3 = vector(3);
  } else {
    const auto* T = std::get_if<Pose>(&*value);
    require(T != nullptr, what + " is a pose");
    **std::get_if<std::optional<Pose>*>(&slot) = *T;
  }
}

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

}  // namespace

const EffectRow* find_row(const std::string& id) {
  const auto& rows = effect_rows();
  const auto found = std::find_if(rows.begin(), rows.end(), [&](const EffectRow& r) { return r.effect.id == id; });
  return found == rows.end() ? nullptr : &*found;
}

int target_index(EffectTarget kind, const std::string& target) {
  if (kind == EffectTarget::WrenchComponent) {
    const auto found = std::find(wrench_names.begin(), wrench_names.end(), target);
    return found == wrench_names.end() ? -1 : static_cast<int>(found - wrench_names.begin());
  }
  const std::string name(name_of(kind));
  if (kind != EffectTarget::Joint && kind != EffectTarget::Motor) return target == name ? 0 : -1;
  int number = 0;
  const char* end = target.data() + target.size();
  if (!target.starts_with(name) || target.size() == name.size()) return -1;
  const auto [stop, error] = std::from_chars(target.data() + name.size(), end, number);
  const bool plain = error == std::errc{} && stop == end && number >= 1 && number <= most_joints;
  return plain && target == target_name(kind, number - 1) ? number - 1 : -1;
}

std::string target_name(EffectTarget kind, int index) {
  if (kind == EffectTarget::WrenchComponent) return wrench_names.at(static_cast<std::size_t>(index));
  const std::string name(name_of(kind));
  return kind == EffectTarget::Joint || kind == EffectTarget::Motor ? name + std::to_string(index + 1) : name;
}

std::string target_text(EffectTarget kind) {
  if (kind == EffectTarget::WrenchComponent) return "fx | fy | fz | tx | ty | tz";
  const std::string name(name_of(kind));
  return kind == EffectTarget::Joint || kind == EffectTarget::Motor ? name + "1, " + name + "2, ..." : name;
}

std::optional<EffectValue> read_slot(const ConstSlot& slot) {
  return std::visit(
      [](const auto* at) -> std::optional<EffectValue> {
        if constexpr (requires { at->has_value(); }) {
          if (!at->has_value()) return std::nullopt;
          return EffectValue(**at);
        } else if constexpr (requires { at->rows(); }) {
          return EffectValue(Eigen::VectorXd(*at));
        } else {
          return EffectValue(static_cast<double>(*at));
        }
      },
      slot);
}

bool same_slot(const ConstSlot& a, const ConstSlot& b) {
  const auto x = read_slot(a), y = read_slot(b);
  if (x.has_value() != y.has_value()) return false;
  if (!x) return true;
  if (const auto* T = std::get_if<Pose>(&*x)) return T->matrix() == std::get<Pose>(*y).matrix();
  if (const auto* v = std::get_if<Eigen::VectorXd>(&*x)) return *v == std::get<Eigen::VectorXd>(*y);
  return std::get<double>(*x) == std::get<double>(*y);
}

std::span<const Effect> effect_catalogue() {
  static const std::vector<Effect> all = [] {
    std::vector<Effect> out;
    for (const EffectRow& row : effect_rows()) out.push_back(row.effect);
    return out;
  }();
  return all;
}

const Effect& find_effect(const std::string& id) { return required_row(id).effect; }

std::vector<std::string> effect_targets(const Effect& effect, const Cell& cell) {
  if (!cell_has(cell, effect.target)) return {};
  int count = 1;
  if (effect.target == EffectTarget::Joint || effect.target == EffectTarget::Motor) count = cell.robot.joints();
  if (effect.target == EffectTarget::WrenchComponent) count = 6;
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) names.push_back(target_name(effect.target, i));
  return names;
}

std::optional<EffectValue> get_effect(const Effects& effects, const std::string& id, const std::string& target,
                                      const std::string& parameter) {
  const EffectRow& row = required_row(id);
  const SlotAccess& slot = required_slot(row, parameter);
  return read_slot(slot.read(effects, required_index(row, target)));
}

void set_effect(Cell& cell, const std::string& id, const std::string& target, const std::string& parameter,
                const std::optional<EffectValue>& value) {
  const EffectRow& row = required_row(id);
  const SlotAccess& slot = required_slot(row, parameter);
  const int index = required_index(row, target);
  const std::vector<std::string> there = effect_targets(row.effect, cell);
  require(!there.empty(),
          "the effect '" + id + "' sits on " + target_text(row.effect.target) + ", which this cell does not have");
  require(index < static_cast<int>(there.size()),
          "this cell has no " + target + " for the effect '" + id + "'; it has " + listed(there));
  write_slot(slot.write(cell.effects, index), value, slot.read(Effects{}, 0),
             "effects." + id + "." + target + "." + parameter);
}

std::vector<ActiveEffect> active_effects(const Effects& effects) {
  const Effects off;
  std::vector<ActiveEffect> out;
  for (const EffectRow& row : effect_rows()) {
    std::size_t count = 1;
    if (row.effect.target == EffectTarget::Joint) count = effects.joints.size();
    if (row.effect.target == EffectTarget::Motor) count = effects.motors.size();
    if (row.effect.target == EffectTarget::WrenchComponent) count = effects.wrench.size();
    for (int i = 0; i < static_cast<int>(count); ++i) {
      ActiveEffect active{row.effect.id, target_name(row.effect.target, i), {}};
      bool on = false, complete = true;  // a coupling without its value means nothing
      for (std::size_t p = 0; p < row.slots.size(); ++p) {
        const ConstSlot slot = row.slots[p].read(effects, i);
        const bool differs = !same_slot(slot, row.slots[p].read(off, i));
        on |= differs;
        const auto value = read_slot(slot);
        const bool required = row.effect.parameters[p].required;
        complete &= value || !required;
        if (value && (differs || required)) active.parameters.emplace_back(row.effect.parameters[p].name, *value);
      }
      if (on && complete) out.push_back(std::move(active));
    }
  }
  return out;
}

}  // namespace kr5::cell
