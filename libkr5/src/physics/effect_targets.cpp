// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/effect_targets.hpp>

#include <algorithm>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>

namespace kr5::physics {

namespace {

/// The part of a cell on which an effect sits, in words.
std::string part_of(const std::string& effect) {
  using enum cell::EffectTarget;
  switch (cell::find_effect(effect).target) {
    case Motor:
    case Drives:
      return "drives";
    case Tool:
    case WrenchComponent:
    case ForceTorque:
      return "tool";
    case Contact:
    case Gripper:
      return "contact";
    case Joint:
    case Base:
    case Links:
      return "joints";
    case Servo:
    case Camera:
    case Laser:
    case Tube:
      break;
  }
  return std::string(name_of(cell::find_effect(effect).target));
}

}  // namespace

void check_effect_targets(const cell::Cell& cell) {
  for (const cell::ActiveEffect& active : cell::active_effects(cell.effects)) {
    const auto targets = cell::effect_targets(cell::find_effect(active.id), cell);
    if (std::find(targets.begin(), targets.end(), active.target) != targets.end()) continue;
    throw InvalidArgument(
        "effects." + active.id + "." + active.target + ": the cell has " +
        (targets.empty() ? "no " + part_of(active.id) : "only " + targets.front() + " to " + targets.back()));
  }
}

}  // namespace kr5::physics
