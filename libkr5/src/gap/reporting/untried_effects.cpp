// SPDX-License-Identifier: BSD-3-Clause
#include "gap/reporting/untried_effects.hpp"

#include <kr5/cell/effect.hpp>

namespace kr5::gap {

std::vector<UntriedEffect> untried_effects(const cell::Cell& cell, const std::vector<EffectName>& unseen) {
  std::vector<UntriedEffect> out;
  for (const cell::Effect& effect : cell::effect_catalogue()) {
    if (cell::part_replaced(effect, cell)) continue;
    if (const std::string part = cell::lacking_part(effect, cell); !part.empty()) {
      out.push_back({effect.id, {}, NotTried::PartMissing, part});
      continue;
    }
    std::vector<std::string> targets;
    for (const EffectName& name : unseen)
      if (name.effect == effect.id) targets.push_back(name.target);
    if (targets.empty()) continue;
    if (targets.size() == cell::effect_targets(effect, cell).size()) targets.clear();
    out.push_back({effect.id, std::move(targets), NotTried::NotRecorded});
  }
  return out;
}

}  // namespace kr5::gap
