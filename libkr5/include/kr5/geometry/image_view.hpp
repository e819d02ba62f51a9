// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

namespace kr5 {

/// Somebody else's 8-bit grey image, row by row from the top. Does not own the pixels.
struct ImageView {
  const std::uint8_t* data = nullptr;
  int width = 0;              ///< [px]
  int height = 0;             ///< [px]
  std::ptrdiff_t stride = 0;  ///< From one row to the next [bytes].

  std::uint8_t at(int x, int y) const { return data[y * stride + x]; }
};

}  // namespace kr5
