// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <kr5/cell/effect.hpp>
#include <kr5/gap/diagnosis.hpp>

namespace kr5::gap {

/// Discrete choice of an effect; 0 where it has none.
inline int choice_of(const cell::Effect& row, const std::vector<ParameterEstimate>& parameters) {
  for (const cell::EffectParameter& known : row.parameters)
    if (known.coordinate == cell::CoordinateKind::Choice)
      for (const ParameterEstimate& p : parameters)
        if (p.name == known.name && !p.value.empty()) return static_cast<int>(p.value[0]);
  return 0;
}

/// What the cell says of a parameter of an effect with these parameters.
inline std::optional<cell::EffectValue> nominal_parameter(const cell::Cell& cell, const EffectName& effect,
                                                          const std::vector<ParameterEstimate>& parameters,
                                                          const std::string& name) {
  return cell::nominal_value(cell, effect.effect, effect.target, name,
                             choice_of(cell::find_effect(effect.effect), parameters));
}

}  // namespace kr5::gap
