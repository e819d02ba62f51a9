// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <kr5/vision/detect.hpp>

namespace kr5::vision {

/// Points seen of a target: indices into `target_points`, pixels and their standard deviations.
struct SeenPoints {
  std::vector<int> index;
  std::vector<Eigen::Vector2d> pixel;
  std::vector<double> sigma;  ///< [px], 0 when not refined.

  void add(int i, const Eigen::Vector2d& p, double s) { index.push_back(i), pixel.push_back(p), sigma.push_back(s); }
};

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

std::optional<SeenPoints> find_chessboard(ImageView image, const Target& target, Refinement refine);
std::optional<SeenPoints> find_circles(ImageView image, const Target& target, Refinement refine);
/// Inner corners of a ChArUco board next to the markers that were seen.
std::optional<SeenPoints> find_charuco(ImageView image, const Target& target, const std::vector<TagDetection>& tags,
                                       Refinement refine);

/// Whether at nearly all points of `grid` two black squares touch, with colours in turn: three in four, or more.
bool is_chessboard(ImageView image, const PixelGrid& grid);
/// The corners of the whole chessboard of which `grid` is a part, as far as the image shows it; those of `grid` itself
/// when the board ends there.
PixelGrid whole_chessboard(ImageView image, PixelGrid grid);
/// Size of the chessboard in the image, whatever it is: rows, columns of inner corners.
std::optional<std::pair<int, int>> seen_chessboard(ImageView image);
/// Puts points into a grid of rows x cols, from neighbour to neighbour; empty unless exactly one such grid is full.
std::optional<PixelGrid> grow_grid(const std::vector<Eigen::Vector2d>& points, int rows, int cols);
/// Number of dots in the image.
int seen_dots(ImageView image);

}  // namespace kr5::vision
