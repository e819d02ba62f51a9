// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/gap/diagnosis.hpp>

namespace kr5::gap {

/// Effects of the catalogue that a cell cannot carry, and those that no column of its recording shows (`unseen`), in
/// the order of the catalogue. Those of a part in whose place another stands are none.
std::vector<UntriedEffect> untried_effects(const cell::Cell& cell, const std::vector<EffectName>& unseen);

}  // namespace kr5::gap
