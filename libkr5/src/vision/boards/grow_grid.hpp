// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "vision/boards/pixel_grid.hpp"

namespace kr5::vision {

/// Puts points into a grid of rows x cols, from neighbour to neighbour; empty unless exactly one such grid is full.
std::optional<PixelGrid> grow_grid(const std::vector<Eigen::Vector2d>& points, int rows, int cols);

}  // namespace kr5::vision
