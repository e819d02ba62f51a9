// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/gap/hypotheses.hpp>

namespace kr5::gap {

/// Lowers the prior of effects that taught poses prove (Effect::proven_by_poses). Loads alone hardly tell a length from
/// a mass or a centre of mass, and lengths are what every taught pose proves, while masses are stated and never looked
/// at again.
void apply_geometry_prior(std::vector<Hypothesis>& hypotheses);

}  // namespace kr5::gap
