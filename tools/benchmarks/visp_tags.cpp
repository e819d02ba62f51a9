// SPDX-License-Identifier: BSD-3-Clause
#include "visp_tags.hpp"

#include <memory>

#include <visp3/core/vpImage.h>
#include <visp3/detection/vpDetectorAprilTag.h>

std::function<std::vector<int>()> visp_tags(const unsigned char* pixels, int width, int height) {
  const auto detector = std::make_shared<vpDetectorAprilTag>(vpDetectorAprilTag::TAG_36h11);
  const auto image = std::make_shared<vpImage<unsigned char>>(
      const_cast<unsigned char*>(pixels), static_cast<unsigned>(height), static_cast<unsigned>(width), true);
  return [=] {
    detector->detect(*image);
    return detector->getTagsId();
  };
}
