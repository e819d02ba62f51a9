// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/gap/hypotheses.hpp>

/// @file
/// What is known of effects before a recording is looked at.

namespace kr5::gap {

/// Lowers the prior of effects that taught poses prove (Effect::proven_by_poses). Loads alone hardly tell a length from
/// a mass or a centre of mass, and lengths are what every taught pose proves, while masses are stated and never looked
/// at again.
void apply_geometry_prior(std::vector<Hypothesis>& hypotheses);

/// Raises the prior of what every arm has (Effect::in_every_arm) and the cell states for none of its joints: what a
/// description leaves out is likelier than what it states wrongly.
void apply_omission_prior(const cell::Cell& cell, std::vector<Hypothesis>& hypotheses);

}  // namespace kr5::gap
