// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/effect_targets.hpp>

#include <algorithm>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>

namespace kr5::physics {

void check_effect_targets(const cell::Cell& cell) {
  const int n = cell.robot.joints();
  for (const cell::ActiveEffect& active : cell::active_effects(cell.effects)) {
    const auto targets = cell::effect_targets(cell::find_effect(active.id), cell);
    require(std::find(targets.begin(), targets.end(), active.target) != targets.end(),
            "effects." + active.id + "." + active.target + ": the cell has only " + std::to_string(n) + " joints");
  }
}

}  // namespace kr5::physics
