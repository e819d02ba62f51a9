// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/vision/image.hpp>

#include "vision/boards/pixel_grid.hpp"

namespace kr5::vision {

/// Whether at nearly all points of `grid` two black squares touch, with colours in turn: three in four, or more.
bool is_chessboard(ImageView image, const PixelGrid& grid);
/// The corners of the whole chessboard of which `grid` is a part, as far as the image shows it; those of `grid` itself
/// when the board ends there.
PixelGrid whole_chessboard(ImageView image, PixelGrid grid);

}  // namespace kr5::vision
