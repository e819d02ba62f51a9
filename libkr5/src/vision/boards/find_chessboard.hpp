// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <utility>

#include <kr5/vision/find_target.hpp>

#include "vision/boards/seen_points.hpp"

namespace kr5::vision {

/// Inner corners of a chessboard that is seen whole.
std::optional<SeenPoints> find_chessboard(ImageView image, const Target& target, Refinement refine);
/// Size of the chessboard in the image, whatever it is: rows, columns of inner corners.
std::optional<std::pair<int, int>> seen_chessboard(ImageView image);

}  // namespace kr5::vision
