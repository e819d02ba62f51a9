// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/cell/recording.hpp>
#include <kr5/gap/hypotheses.hpp>

namespace kr5::gap {

/// Whether a recording shows the links of the arm in its loads alone, no pose of the tool among its columns.
bool only_loads(const cell::Recording& recording);

/// Lowers the prior of effects that change lengths and angles of links. Loads alone hardly tell a length from a mass or
/// a centre of mass, and lengths are what every taught pose proves, while masses are stated and never looked at again.
void doubt_geometry(std::vector<Hypothesis>& hypotheses);

}  // namespace kr5::gap
