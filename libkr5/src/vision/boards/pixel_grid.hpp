// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

namespace kr5::vision {

/// Points of a regular grid in the image, row by row.
struct PixelGrid {
  int rows = 0, cols = 0;
  std::vector<Eigen::Vector2d> points;

  const Eigen::Vector2d& at(int r, int c) const { return points[static_cast<std::size_t>(r * cols + c)]; }
  /// The four (or, with rows != cols, two) ways to turn the grid; all with X to the right when Y is down.
  std::vector<PixelGrid> turned() const;
  /// From a point to the next along a row, and along a column.
  Eigen::Vector2d along_x(int r, int c) const;
  Eigen::Vector2d along_y(int r, int c) const;
};

}  // namespace kr5::vision
