// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include <kr5/vision/find_target.hpp>

#include "vision/boards/seen_points.hpp"

namespace kr5::vision {

/// Inner corners of a ChArUco board next to the markers that were seen.
std::optional<SeenPoints> find_charuco(ImageView image, const Target& target, const std::vector<TagDetection>& tags,
                                       Refinement refine);

}  // namespace kr5::vision
