// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include <kr5/io/node.hpp>

namespace kr5::sim {

/// The whole state of a work cell between two cycles, as it is written to a file: arm and servos on their way, sensors,
/// grip, pellets in motion, random numbers. Its content is the cell's own; `WorkCell::restore` reads it.
struct WorkCellState {
  io::Node document;
};

/// Writes the state in one go: a process that ends meanwhile leaves the file of before.
/// @throws IoError naming the file.
void save_state(const WorkCellState& state, const std::filesystem::path& file);
/// @throws IoError naming the file, for one that is not there or is no state of a work cell.
WorkCellState load_state(const std::filesystem::path& file);

}  // namespace kr5::sim
