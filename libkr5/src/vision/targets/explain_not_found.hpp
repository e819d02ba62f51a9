// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/vision/find_target.hpp>

namespace kr5::vision {

/// Says in `result` why nothing was found in the image.
void explain_not_found(ImageView image, const Target& target, Detection& result);

/// Says in `result` that the target is seen when left and right, or black and white, are exchanged.
void say_mirrored(Detection& result);
void say_inverted(Detection& result);
Image mirrored_image(ImageView image);
Image inverted_image(ImageView image);

/// Says in `result` that the markers lie as on a grid of other rows and columns.
void say_other_layout(const Target& target, const Target& other, Detection& result);

}  // namespace kr5::vision
