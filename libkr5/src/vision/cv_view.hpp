// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <kr5/core/error.hpp>
#include <kr5/vision/image.hpp>

namespace kr5::vision {

/// The same pixels as OpenCV's matrix; must not be written to.
inline cv::Mat cv_view(ImageView image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data),
          static_cast<std::size_t>(image.stride)};
}

inline void require_image(ImageView image) {
  require(image.data != nullptr && image.width > 0 && image.height > 0 && image.stride >= image.width,
          "image: is empty; expected 8-bit grey levels with width and height above 0");
  require(image.width <= 65535 && image.height <= 65535, "image: width and height must not exceed 65535 [px]");
}

}  // namespace kr5::vision
