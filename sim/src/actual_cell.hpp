// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>
#include <kr5/sim/insertion.hpp>

namespace kr5::sim {

/// The cell as it is in truth: the bore made to the clearance, the tube where it stands, what is not known exactly
/// drawn.
cell::Cell actual_cell(const cell::Cell& given, const InsertionSetup& setup);

}  // namespace kr5::sim
