// SPDX-License-Identifier: BSD-3-Clause
#include "vision/boards/pixel_grid.hpp"

#include <algorithm>

namespace kr5::vision {

Eigen::Vector2d PixelGrid::along_x(int r, int c) const {
  const int a = std::max(c - 1, 0), b = std::min(c + 1, cols - 1);
  return (at(r, b) - at(r, a)) / (b - a);
}

Eigen::Vector2d PixelGrid::along_y(int r, int c) const {
  const int a = std::max(r - 1, 0), b = std::min(r + 1, rows - 1);
  return (at(b, c) - at(a, c)) / (b - a);
}

std::vector<PixelGrid> PixelGrid::turned() const {
  PixelGrid g = *this;
  const Eigen::Vector2d x = g.at(0, g.cols - 1) - g.at(0, 0), y = g.at(g.rows - 1, 0) - g.at(0, 0);
  if (x.x() * y.y() - x.y() * y.x() < 0)  // numbered as in a mirror
    for (int r = 0; r < rows; ++r) std::reverse(g.points.begin() + r * cols, g.points.begin() + (r + 1) * cols);
  std::vector<PixelGrid> all{g, g};
  std::reverse(all[1].points.begin(), all[1].points.end());
  if (rows != cols) return all;
  for (int k = 0; k < 2; ++k) {
    PixelGrid quarter = all[static_cast<std::size_t>(k)];
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < cols; ++c)
        quarter.points[static_cast<std::size_t>(r * cols + c)] = all[static_cast<std::size_t>(k)].at(rows - 1 - c, r);
    all.push_back(quarter);
  }
  return all;
}

}  // namespace kr5::vision
