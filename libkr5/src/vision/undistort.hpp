// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/geometry/pinhole.hpp>
#include <kr5/vision/image.hpp>

namespace kr5::vision {

/// An image as by a camera without a lens.
struct PlainView {
  Image image;
  Pinhole camera;  ///< All coefficients of the lens are 0.
};

/// The same image without the lens, of the same focal length and large enough to hold all of it, but at most one and a
/// half times as wide and as high. What the image does not show is black.
PlainView undistort(ImageView image, const Pinhole& camera);

}  // namespace kr5::vision
