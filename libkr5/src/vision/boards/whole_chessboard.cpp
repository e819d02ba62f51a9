// SPDX-License-Identifier: BSD-3-Clause
#include "vision/boards/whole_chessboard.hpp"

#include <algorithm>
#include <cmath>

#include "vision/boards/refine_point.hpp"

namespace kr5::vision {
namespace {

using Eigen::Vector2d;
constexpr double wanted_contrast = 0.4;  // of that of the neighbouring corner: shade may lie across the board
constexpr double farthest = 0.3;         // of a step; distortion moves the corner off the extrapolated place by less
constexpr int most_corners = 100;        // along a side

/// The grid turned by k quarters, so that every side is the left one once.
PixelGrid quarter_turned(const PixelGrid& g, int k) {
  PixelGrid out = g;
  for (; k > 0; --k) {
    const PixelGrid from = out;
    std::swap(out.rows, out.cols);
    for (int r = 0; r < out.rows; ++r)
      for (int c = 0; c < out.cols; ++c)
        out.points[static_cast<std::size_t>(r * out.cols + c)] = from.at(from.rows - 1 - c, r);
  }
  return out;
}

/// Mean grey of 3 x 3 pixels; nothing when they are not all in the image.
std::optional<double> mean_grey_at(ImageView image, const Vector2d& p) {
  const int x = static_cast<int>(std::lround(p.x())), y = static_cast<int>(std::lround(p.y()));
  if (x < 1 || y < 1 || x + 1 >= image.width || y + 1 >= image.height) return std::nullopt;
  double sum = 0;
  for (int v = -1; v <= 1; ++v)
    for (int u = -1; u <= 1; ++u) sum += image.at(x + u, y + v);
  return sum / 9;
}

/// By how much both quarters of one diagonal outshine both of the other: positive when those along dx + dy do,
/// negative when the others do, 0 when it is no corner where two black squares touch. Nothing beyond the image.
std::optional<double> crossing(ImageView image, const Vector2d& at, const Vector2d& dx, const Vector2d& dy) {
  const auto a = mean_grey_at(image, at + 0.3 * (dx + dy)), b = mean_grey_at(image, at - 0.3 * (dx + dy));
  const auto c = mean_grey_at(image, at + 0.3 * (dx - dy)), d = mean_grey_at(image, at - 0.3 * (dx - dy));
  if (!a || !b || !c || !d) return std::nullopt;
  const double up = std::min(*a, *b) - std::max(*c, *d), down = std::min(*c, *d) - std::max(*a, *b);
  return up > 0 ? up : down > 0 ? -down : 0.0;
}

/// The column of corners left of the first one, when the board goes on there. On its last squares, where paper
/// begins, no two black squares touch: chance gives hardly one such corner at its place with colours in turn, a board
/// that goes on nearly all. Half of those that the image can show, and two, keep both errors rare.
std::optional<std::vector<Vector2d>> column_beyond(ImageView image, const PixelGrid& g) {
  std::vector<Vector2d> column;
  int judged = 0, seen = 0;
  for (int r = 0; r < g.rows; ++r) {
    Vector2d at = 3 * g.at(r, 0) - 3 * g.at(r, 1) + g.at(r, 2);
    const Vector2d dx = g.at(r, 0) - at, dy = g.along_y(r, 0);
    const auto first = crossing(image, g.at(r, 0), g.along_x(r, 0), dy), own = crossing(image, at, dx, dy);
    if (first && own) {
      ++judged;
      const double radius = std::clamp(0.45 * std::min(dx.norm(), dy.norm()), 2.0, 12.0);
      const auto corner = refine_saddle(image, at, dx, dy, radius);
      const bool near = corner && (corner->pixel - at).norm() < farthest * std::min(dx.norm(), dy.norm());
      const double sharp = near ? crossing(image, corner->pixel, dx, dy).value_or(0.0) : 0.0;
      if (-sharp * *first > wanted_contrast * *first * *first) ++seen, at = corner->pixel;
    }
    column.push_back(at);
  }
  if (seen < 2 || 2 * seen < judged) return std::nullopt;
  return column;
}

}  // namespace

bool is_chessboard(ImageView image, const PixelGrid& grid) {
  int judged = 0, balance = 0;
  for (int r = 0; r < grid.rows; ++r)
    for (int c = 0; c < grid.cols; ++c)
      if (const auto way = crossing(image, grid.at(r, c), grid.along_x(r, c), grid.along_y(r, c))) {
        ++judged;
        balance += ((r + c) % 2 == 0 ? 1 : -1) * (*way > 0 ? 1 : *way < 0 ? -1 : 0);
      }
  return 2 * std::abs(balance) > judged;
}

PixelGrid whole_chessboard(ImageView image, PixelGrid grid) {
  if (grid.rows < 3 || grid.cols < 3) return grid;
  for (int side = 0, ended = 0; ended < 4 && std::max(grid.rows, grid.cols) < most_corners; ++side) {
    const PixelGrid turned = quarter_turned(grid, side % 4);
    const auto column = column_beyond(image, turned);
    ended = column ? 0 : ended + 1;
    if (!column) continue;
    PixelGrid wider{turned.rows, turned.cols + 1, {}};
    for (int r = 0; r < turned.rows; ++r) {
      wider.points.push_back((*column)[static_cast<std::size_t>(r)]);
      for (int c = 0; c < turned.cols; ++c) wider.points.push_back(turned.at(r, c));
    }
    grid = quarter_turned(wider, 4 - side % 4);
  }
  return grid;
}

}  // namespace kr5::vision
