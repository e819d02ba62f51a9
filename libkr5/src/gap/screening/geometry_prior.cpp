// SPDX-License-Identifier: BSD-3-Clause
#include "gap/screening/geometry_prior.hpp"

#include <algorithm>
#include <cmath>

#include <kr5/cell/effect.hpp>

namespace kr5::gap {
namespace {

/// Prior odds of a wrong length against a wrong mass.
constexpr double length_against_mass = 0.01;

/// Whether an effect replaces a length or an angle of a link.
bool changes_links(const Hypothesis& h) {
  const cell::Effect& row = cell::find_effect(h.effect);
  return row.target == cell::EffectTarget::Joint &&
         std::ranges::any_of(row.parameters, [](const cell::EffectParameter& p) {
           return p.nominal_when_off && p.kind == cell::EffectValueKind::Number && (p.unit == "m" || p.unit == "rad");
         });
}

}  // namespace

void doubt_geometry(std::vector<Hypothesis>& hypotheses) {
  for (Hypothesis& h : hypotheses)
    if (changes_links(h)) h.log_prior += std::log(length_against_mass);
}

}  // namespace kr5::gap
