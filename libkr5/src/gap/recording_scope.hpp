// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/cell/recording.hpp>
#include <kr5/gap/findings.hpp>

namespace kr5::gap {

/// Limits of what a recording can show: experiments of too few rows, motions in which nothing moves, and a recording of
/// a single kind, which speaks for a part of the cell only.
std::vector<ScopeLimit> scope_limits(const cell::Recording& recording);

/// Whether a recording shows the links of the arm in its loads alone, no pose of the tool among its columns.
bool only_loads(const cell::Recording& recording);

}  // namespace kr5::gap
