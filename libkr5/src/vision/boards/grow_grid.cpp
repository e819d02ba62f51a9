// SPDX-License-Identifier: BSD-3-Clause
#include "vision/boards/grow_grid.hpp"

#include <algorithm>
#include <map>
#include <queue>

namespace kr5::vision {
namespace {

using Eigen::Vector2d;
using Place = std::pair<int, int>;  // row, column

struct Node {
  int point;
  Vector2d to_right, to_below;
};

int nearest(const std::vector<Vector2d>& points, const Vector2d& p, double within, int except = -1) {
  int best = -1;
  for (int i = 0; i < static_cast<int>(points.size()); ++i) {
    const double d = (points[static_cast<std::size_t>(i)] - p).norm();
    if (i != except && d < within) best = i, within = d;
  }
  return best;
}

/// From one point to its neighbours, to theirs, and so on; steps are those of the last pair, so they follow
/// perspective.
std::map<Place, int> grow(const std::vector<Vector2d>& points, int seed) {
  const Vector2d p = points[static_cast<std::size_t>(seed)];
  const int next = nearest(points, p, 1e9, seed);
  const Vector2d right = points[static_cast<std::size_t>(next)] - p;
  int across = -1;
  double least = 2.5 * right.norm();
  for (int i = 0; i < static_cast<int>(points.size()); ++i) {
    const Vector2d d = points[static_cast<std::size_t>(i)] - p;
    const double cosine = std::abs(d.dot(right)) / (d.norm() * right.norm() + 1e-12);
    if (i != seed && cosine < 0.6 && d.norm() < least) across = i, least = d.norm();
  }
  std::map<Place, int> placed;
  if (across < 0) return placed;
  std::map<int, bool> used{{seed, true}};
  std::queue<std::pair<Place, Node>> open;
  open.push({{0, 0}, {seed, right, points[static_cast<std::size_t>(across)] - p}});
  placed[{0, 0}] = seed;
  while (!open.empty()) {
    const auto [place, node] = open.front();
    open.pop();
    const Vector2d at = points[static_cast<std::size_t>(node.point)];
    for (const Place& step : {Place{0, 1}, Place{0, -1}, Place{1, 0}, Place{-1, 0}}) {
      const Place there{place.first + step.first, place.second + step.second};
      if (placed.contains(there)) continue;
      const Vector2d guess = step.second * node.to_right + step.first * node.to_below;
      const int found = nearest(points, at + guess, 0.3 * guess.norm());
      if (found < 0 || used[found]) continue;
      used[found] = true;
      placed[there] = found;
      Node neighbour{found, node.to_right, node.to_below};
      const Vector2d seen = points[static_cast<std::size_t>(found)] - at;
      (step.second != 0 ? neighbour.to_right : neighbour.to_below) = (step.first + step.second) * seen;
      open.push({there, neighbour});
    }
  }
  return placed;
}

/// The only full window of rows x cols, or nothing.
std::optional<PixelGrid> window(const std::vector<Vector2d>& points, const std::map<Place, int>& placed, int rows,
                                int cols) {
  std::optional<PixelGrid> only;
  for (const auto& [start, unused] : placed) {
    PixelGrid grid{rows, cols, {}};
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < cols; ++c) {
        const auto it = placed.find({start.first + r, start.second + c});
        if (it != placed.end()) grid.points.push_back(points[static_cast<std::size_t>(it->second)]);
      }
    if (grid.points.size() != static_cast<std::size_t>(rows * cols)) continue;
    if (only) return std::nullopt;
    only = grid;
  }
  return only;
}

PixelGrid transposed(const PixelGrid& g) {
  PixelGrid out{g.cols, g.rows, {}};
  for (int c = 0; c < g.cols; ++c)
    for (int r = 0; r < g.rows; ++r) out.points.push_back(g.at(r, c));
  return out;
}

}  // namespace

std::optional<PixelGrid> grow_grid(const std::vector<Vector2d>& points, int rows, int cols) {
  if (points.size() < static_cast<std::size_t>(rows * cols)) return std::nullopt;
  for (std::size_t seed = 0; seed < points.size(); seed += std::max<std::size_t>(points.size() / 8, 1)) {
    const auto placed = grow(points, static_cast<int>(seed));
    if (placed.size() < static_cast<std::size_t>(rows * cols)) continue;
    if (auto grid = window(points, placed, rows, cols)) return grid;
    if (auto grid = window(points, placed, cols, rows)) return transposed(*grid);
  }
  return std::nullopt;
}

}  // namespace kr5::vision
