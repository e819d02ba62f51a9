// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/cell/effect.hpp>
#include <kr5/gap/hypotheses.hpp>

/// @file
/// A row of the catalogue as a hypothesis: its parameters as functions of search coordinates.

namespace kr5::gap {

/// Every hypothesis of an effect on one target: one for each of its choices, or for each parameter where they are
/// searched one at a time. Choices that are cycles a turn are left at `cycles`.
std::vector<Hypothesis> row_hypotheses(const cell::Effect& effect, const cell::EffectSite& site,
                                       const std::string& target, int cycles = 1);

}  // namespace kr5::gap
