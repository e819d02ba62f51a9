// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include <kr5/geometry/image_view.hpp>

namespace kr5::vision {

using kr5::ImageView;

/// An 8-bit grey image.
struct Image {
  int width = 0;   ///< [px]
  int height = 0;  ///< [px]
  std::vector<std::uint8_t> pixels;

  Image() = default;
  Image(int w, int h, std::uint8_t grey = 0);
  ImageView view() const { return {pixels.data(), width, height, width}; }
  operator ImageView() const { return view(); }  // NOLINT: an image is seen as a view everywhere
  std::uint8_t& at(int x, int y) {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
};

/// Reads any image OpenCV can, as grey. @throws IoError naming file and remedy.
Image load_image(const std::filesystem::path& file);
/// Writes PNG (or the format of the file extension), beside and renamed. @throws IoError naming the file.
void save_image(ImageView image, const std::filesystem::path& file);

}  // namespace kr5::vision
