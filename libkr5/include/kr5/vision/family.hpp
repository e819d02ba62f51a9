// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

/// @file
/// What the markers of `kr5::marker_families` look like.

namespace kr5::vision {

/// The cells of one marker as printed, row by row from the top left.
struct MarkerPattern {
  int cells = 0;                    ///< The picture has cells x cells of them, with any white rim the family needs.
  int square = 0;                   ///< The middle square x square ones make the side `size` whose corners are found.
  std::vector<std::uint8_t> white;  ///< 1: white, 0: black.

  /// Whether the cell is white; outside the picture the paper is, too.
  bool at(int row, int col) const {
    if (row < 0 || col < 0 || row >= cells || col >= cells) return true;
    return white[static_cast<std::size_t>(row) * static_cast<std::size_t>(cells) + static_cast<std::size_t>(col)] != 0;
  }
};

/// The marker with number `id`. @throws InvalidArgument for an unknown family, or an id it does not have.
MarkerPattern marker_pattern(const std::string& family, int id);

}  // namespace kr5::vision
