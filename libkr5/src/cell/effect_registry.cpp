// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/effect_registry.hpp>

#include <algorithm>
#include <utility>

#include <kr5/core/error.hpp>

#include "cell/effect_rows.hpp"

namespace kr5::cell {
namespace {

bool has_law(const Effect& row) { return row.change_cell || row.change_columns; }

void require_complete(const Effect& row) {
  const std::string where = "effect '" + row.id + "': ";
  require(!row.id.empty(), "an effect needs an id");
  require(find_row(row.id) == nullptr, where + "the catalogue already has an effect of this name");
  require(has_law(row), where + "expected change_cell (changes the cell) or change_columns (changes the columns)");
  require(!row.parameters.empty(), where + "expected at least one parameter");
  for (const EffectParameter& p : row.parameters) {
    require(!p.name.empty(), where + "a parameter has no name");
    require(p.lower < p.upper, where + p.name + ".lower must be below upper");
    const bool sized = p.coordinate != CoordinateKind::Linear && p.coordinate != CoordinateKind::Ratio;
    require(sized || p.size || p.usual_size > 0, where + p.name + ".usual_size must be positive");
    require(p.coordinate != CoordinateKind::Linear || p.nominal ||
                std::all_of(p.off.begin(), p.off.end(), [&](double x) { return x >= p.lower && x <= p.upper; }),
            where + p.name + ": its bounds must contain the off value");
  }
}

}  // namespace

void register_effect(Effect effect) {
  effect = completed(std::move(effect));
  require_complete(effect);
  if (effect.label.empty()) {
    effect.label = effect.id;
    std::replace(effect.label.begin(), effect.label.end(), '_', ' ');
  }
  add_row(std::move(effect));
}

void unregister_effect(const std::string& id) {
  require(has_law(required_row(id)), "the effect '" + id + "' is built into the library");
  remove_row(id);
}

}  // namespace kr5::cell
