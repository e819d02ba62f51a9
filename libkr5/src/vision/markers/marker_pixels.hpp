// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "vision/markers/marker_geometry.hpp"

namespace kr5::vision::marker {

/// At most `most` pixels within `reach` [px] of edges of the pattern, and a tenth as many on flat ground. Where `p` has
/// no white yet, its two greys are set from them.
std::vector<Sample> choose_pixels(const ImageView& image, const MarkerPattern& pattern, const Geometry& geometry,
                                  Vector& p, const Corners& corners, double reach, int most);

}  // namespace kr5::vision::marker
