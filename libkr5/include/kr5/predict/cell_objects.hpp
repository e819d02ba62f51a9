// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/cell/placed_object.hpp>

/// @file
/// Objects in a cell, for camera, scanner and pictures of it, with the effects on the tube.

namespace kr5::predict {

/// Board (first) and targets of the cell.
std::vector<cell::Target> cell_targets(const cell::Cell& cell);
/// Tube and sphere of the scanner's target.
std::vector<cell::PlacedObject> cell_solids(const cell::Cell& cell);
/// All that rays of the scanner may meet: tube, board and targets, sphere and plane of the scanner's target. The plane
/// reaches 10 m from the base.
std::vector<cell::PlacedObject> scanner_objects(const cell::Cell& cell);
/// A horizontal plate of that size at a height in the base [m].
cell::PlacedObject wide_plate(const std::string& name, double height);

}  // namespace kr5::predict
