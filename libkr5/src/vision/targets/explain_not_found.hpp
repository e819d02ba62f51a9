// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/vision/find_target.hpp>

namespace kr5::vision {

/// Says in `result` why nothing was found in the image.
void explain_not_found(ImageView image, const Target& target, Detection& result);

/// Says in `result` that the markers lie as on a grid of other rows and columns.
void say_other_layout(const Target& target, const Target& other, Detection& result);

}  // namespace kr5::vision
