// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/gap/measure.hpp>

/// @file
/// What of the cell a column shows.

namespace kr5::gap {

/// The target of the catalogue nearest to it, e.g. joint3, tool, camera; a component of a wrench itself.
std::string target_of(cell::Kind kind, const std::string& column);
std::vector<GapPart> parts_of(const std::vector<ColumnGap>& columns);

}  // namespace kr5::gap
