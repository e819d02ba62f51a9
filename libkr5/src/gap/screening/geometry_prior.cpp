// SPDX-License-Identifier: BSD-3-Clause
#include "gap/screening/geometry_prior.hpp"

#include <cmath>

#include <kr5/cell/effect.hpp>

namespace kr5::gap {
namespace {

/// Prior odds of a wrong length against a wrong mass.
constexpr double length_against_mass = 0.01;

}  // namespace

void apply_geometry_prior(std::vector<Hypothesis>& hypotheses) {
  for (Hypothesis& h : hypotheses)
    if (cell::find_effect(h.effect).proven_by_poses) h.log_prior += std::log(length_against_mass);
}

}  // namespace kr5::gap
