// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include <kr5/vision/find_target.hpp>

#include "vision/boards/seen_points.hpp"

namespace kr5::vision {

/// Centres of the dots of a grid that is seen whole.
std::optional<SeenPoints> find_circles(ImageView image, const Target& target, Refinement refine);
/// Whether the dots are those of an asymmetric grid of OpenCV, of which every other row is shifted by half a step.
bool shows_shifted_rows(ImageView image, int rows, int cols);
/// Number of dots in the image.
int seen_dots(ImageView image);

}  // namespace kr5::vision
