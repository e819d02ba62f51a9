// SPDX-License-Identifier: BSD-3-Clause
#include "vision/boards/find_chessboard.hpp"

#include <algorithm>
#include <limits>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "vision/boards/refine_point.hpp"
#include "vision/boards/whole_chessboard.hpp"
#include "vision/cv_view.hpp"

namespace kr5::vision {
namespace {

using Eigen::Vector2d;

/// Mean grey of the squares that should be white over that of those that should be black (the one at the first
/// corner is), the ones around the corners included.
double colour_order(ImageView image, const PixelGrid& g) {
  double sum = 0;
  for (int r = -1; r < g.rows; ++r)
    for (int c = -1; c < g.cols; ++c) {
      const int i = std::clamp(r, 0, g.rows - 2), j = std::clamp(c, 0, g.cols - 2);
      const Vector2d dx = g.at(i, j + 1) - g.at(i, j), dy = g.at(i + 1, j) - g.at(i, j);
      const Vector2d p =
          (g.at(i, j) + g.at(i + 1, j) + g.at(i, j + 1) + g.at(i + 1, j + 1)) / 4 + (c - j) * dx + (r - i) * dy;
      const int x = static_cast<int>(std::lround(p.x())), y = static_cast<int>(std::lround(p.y()));
      if (x < 0 || y < 0 || x >= image.width || y >= image.height) continue;
      sum += (r + c) % 2 == 0 ? -image.at(x, y) : image.at(x, y);
    }
  return sum;
}

PixelGrid grid_of(const std::vector<cv::Point2f>& corners, int rows, int cols) {
  PixelGrid grid{rows, cols, {}};
  for (const cv::Point2f& p : corners) grid.points.emplace_back(p.x, p.y);
  return grid;
}

/// The largest board that shows, found by its 3x3 corners or more.
std::optional<PixelGrid> whole_board(ImageView image) {
  std::vector<cv::Point2f> corners;
  cv::Mat meta;
  if (!cv::findChessboardCornersSB(cv_view(image), cv::Size(3, 3), corners,
                                   cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_LARGER, meta))
    return std::nullopt;
  return whole_chessboard(image, grid_of(corners, meta.rows, meta.cols));
}

/// OpenCV's ways, quick ones first. Asked for a small board, it patches one together from corners of a larger one.
std::optional<PixelGrid> corners_by_opencv(ImageView image, int rows, int cols) {
  if (rows < 3 || cols < 3) return std::nullopt;
  const cv::Mat picture = cv_view(image);
  const cv::Size size(cols, rows);
  for (int way = 0; way < 3; ++way) {
    if (way == 1) {  // these take seconds where the board is another
      const auto whole = whole_board(image);
      if (whole && whole->points.size() > static_cast<std::size_t>(rows * cols)) return std::nullopt;
    }
    std::vector<cv::Point2f> corners;
    const bool found =
        way == 1 ? cv::findChessboardCorners(
                       picture, size, corners,
                       cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK)
                 : cv::findChessboardCornersSB(
                       picture, size, corners,
                       cv::CALIB_CB_NORMALIZE_IMAGE | (way == 2 ? cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_ACCURACY : 0));
    if (!found || corners.size() != static_cast<std::size_t>(rows * cols)) continue;
    PixelGrid grid = grid_of(corners, rows, cols);
    if (is_chessboard(image, grid)) return grid;
  }
  return std::nullopt;
}

}  // namespace

std::optional<SeenPoints> find_chessboard(ImageView image, const Target& target, Refinement refine) {
  const auto raw = corners_by_opencv(image, target.rows, target.cols);
  if (!raw || whole_chessboard(image, *raw).points.size() > raw->points.size()) return std::nullopt;
  const std::vector<PixelGrid> ways = raw->turned();
  const auto& grid = *std::min_element(ways.begin(), ways.end(), [&](const PixelGrid& a, const PixelGrid& b) {
    const bool good_a = colour_order(image, a) > 0, good_b = colour_order(image, b) > 0;
    return good_a != good_b ? good_a : a.at(0, 0).sum() < b.at(0, 0).sum();
  });
  SeenPoints seen;
  for (int r = 0; r < grid.rows; ++r)
    for (int c = 0; c < grid.cols; ++c) {
      const Vector2d dx = grid.along_x(r, c), dy = grid.along_y(r, c);
      const double sine = std::abs(dx.x() * dy.y() - dx.y() * dy.x()) / (dx.norm() * dy.norm());
      const double radius = std::clamp(0.45 * std::min(dx.norm(), dy.norm()) * std::max(sine, 0.5), 2.0, 12.0);
      const auto better =
          refine == Refinement::Model ? refine_saddle(image, grid.at(r, c), dx, dy, radius) : std::nullopt;
      seen.add(r * grid.cols + c, better ? better->pixel : grid.at(r, c), better ? better->sigma : 0.0);
    }
  return seen;
}

std::optional<std::pair<int, int>> seen_chessboard(ImageView image) {
  const auto whole = whole_board(image);
  if (!whole) return std::nullopt;
  return std::pair{whole->rows, whole->cols};
}

}  // namespace kr5::vision
