// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>
#include <kr5/io/reader.hpp>

#include "cell/complaints.hpp"

namespace kr5::cell {

/// Reads a document and collects every problem of form. The cell may only be used when there is none.
Cell read_cell(const io::Node& root, const std::string& file, std::vector<io::Problem>& problems);
/// The document of a cell in the form it was read.
io::Node cell_node(const Cell& cell);

/// Sizes that do not fit, parts that contradict each other: such a cell cannot be computed with.
void check_form(const Cell& cell, Complaints& complaints);
/// Values no real cell has: masses, inertias, limits, drives, effects out of bounds.
void check_physics(const Cell& cell, Complaints& complaints);
/// Values that look like another unit.
void check_units(const Cell& cell, const io::Node& root, Complaints& complaints);

}  // namespace kr5::cell
