// SPDX-License-Identifier: BSD-3-Clause
#include "gap/screening/effect_prior.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <variant>

#include <kr5/cell/effect.hpp>

namespace kr5::gap {
namespace {

/// Prior odds of a wrong length against a wrong mass.
constexpr double length_against_mass = 0.01;
/// Prior odds of a value that was left out against one that was stated wrongly.
constexpr double left_out_against_wrong = 10.0;

/// Whether a cell states the effect for none of its targets: 0 everywhere.
bool left_out(const cell::Effect& effect, const cell::Cell& cell) {
  const std::string& parameter = effect.parameters.front().name;
  return std::ranges::all_of(cell::effect_targets(effect, cell), [&](const std::string& target) {
    const auto value = cell::nominal_value(cell, effect.id, target, parameter);
    return !value || (std::holds_alternative<double>(*value) && std::get<double>(*value) == 0.0);
  });
}

}  // namespace

void apply_geometry_prior(std::vector<Hypothesis>& hypotheses) {
  for (Hypothesis& h : hypotheses)
    if (cell::find_effect(h.effect).proven_by_poses) h.log_prior += std::log(length_against_mass);
}

void apply_omission_prior(const cell::Cell& cell, std::vector<Hypothesis>& hypotheses) {
  std::map<std::string, bool> known;
  for (Hypothesis& h : hypotheses) {
    const cell::Effect& effect = cell::find_effect(h.effect);
    if (!effect.in_every_arm) continue;
    const auto [entry, added] = known.try_emplace(h.effect, false);
    if (added) entry->second = left_out(effect, cell);
    if (entry->second) h.log_prior += std::log(left_out_against_wrong);
  }
}

}  // namespace kr5::gap
