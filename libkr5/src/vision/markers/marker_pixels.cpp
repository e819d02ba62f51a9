// SPDX-License-Identifier: BSD-3-Clause
#include "vision/markers/marker_pixels.hpp"

#include <algorithm>
#include <cmath>

namespace kr5::vision::marker {
namespace {

class PixelChoice {
 public:
  PixelChoice(const ImageView& image, const MarkerPattern& pattern, const Geometry& geometry, const Vector& p,
              double reach, int most)
      : image_(image),
        pattern_(pattern),
        geometry_(geometry),
        p_(p),
        reach_(reach),
        reach_cells_(reach / geometry.half()),
        most_(most) {}

  void look_around(const Corners& corners) {
    const double side = 2 * geometry_.half(), band = 2 * reach_ * side * pattern_.square;  // half the borders are edges
    edge_.reserve(static_cast<std::size_t>(2 * most_)), flat_.reserve(static_cast<std::size_t>(most_ / 2));
    if (band > 2.5 * most_)
      walk();
    else
      scan(corners);
    thin(edge_, most_);
    thin(flat_, most_ / 10);
  }

  std::vector<Sample> pixels() {
    edge_.insert(edge_.end(), flat_.begin(), flat_.end());
    return std::move(edge_);
  }

  void set_greys(Vector& p) {
    const auto median = [](std::vector<double>& v) {
      std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
      return v[v.size() / 2];
    };
    double dark = 255, light = 0;
    for (const Sample& s : edge_) dark = std::min(dark, s.grey), light = std::max(light, s.grey);
    if (black_.size() > 8) dark = median(black_);
    if (white_.size() > 8) light = median(white_);
    p[9] = dark;
    p[10] = std::max(light - dark, 1.0);
  }

 private:
  using Segment = std::pair<Eigen::Vector2d, Eigen::Vector2d>;

  /// Keeps a pixel if it is of use.
  void look(int x, int y) {
    Sample s = geometry_.sample({x, y});
    s.grey = image_.at(x, y);
    const Sample straight = Geometry::straight(p_, s);
    const Cell c = to_cell(p_, straight.x, straight.y);
    const int kind = classify(c);
    if (kind == 1) edge_.push_back(s);
    if (kind == 2) (cell(c.uv.x(), c.uv.y()) ? white_ : black_).push_back(s.grey), flat_.push_back(s);
  }

  /// Small markers: every pixel is looked at, or every so many-th.
  void scan(const Corners& corners) {
    const Eigen::Vector2d cell = (corners.rowwise().maxCoeff() - corners.rowwise().minCoeff()) / pattern_.square;
    const Eigen::Vector2d low = corners.rowwise().minCoeff() - 2.0 * cell,
                          high = corners.rowwise().maxCoeff() + 2.0 * cell;
    const int x0 = std::max(0, static_cast<int>(low.x())), x1 = std::min(image_.width - 1, static_cast<int>(high.x()));
    const int y0 = std::max(0, static_cast<int>(low.y())), y1 = std::min(image_.height - 1, static_cast<int>(high.y()));
    const int stride =
        std::max(1, (x1 - x0 + 1) * (y1 - y0 + 1) / (8 * most_));  // far more than `most_` are not needed
    for (int y = y0; y <= y1; ++y)
      for (int x = x0 + 5 * y % stride; x <= x1; x += stride) look(x, y);
  }

  /// Large markers: pixels strewn along the edges of the pattern, and about the middles of cells.
  void walk() {
    const int low = geometry_.lowest(), n = pattern_.cells - 2 * low;
    const Eigen::Matrix3d H = Geometry::to_image(p_);
    std::vector<Eigen::Vector2d> knot;
    for (int v = 0; v <= n; ++v)
      for (int u = 0; u <= n; ++u) knot.push_back(geometry_.pixel_of(geometry_.place(p_, H, {low + u, low + v})));
    const auto at = [&](int u, int v) { return knot[static_cast<std::size_t>(v * (n + 1) + u)]; };
    std::vector<Segment> edges;
    std::vector<Eigen::Vector2d> wanted;
    wanted.reserve(static_cast<std::size_t>(2 * most_));
    double length = 0;
    const auto edge = [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
      edges.emplace_back(a, b), length += (b - a).norm();
    };
    for (int v = 0; v < n; ++v)
      for (int u = 0; u < n; ++u) {
        const bool here = pattern_.at(low + v, low + u);
        if (u + 1 < n && pattern_.at(low + v, low + u + 1) != here) edge(at(u + 1, v), at(u + 1, v + 1));
        if (v + 1 < n && pattern_.at(low + v + 1, low + u) != here) edge(at(u, v + 1), at(u + 1, v + 1));
        const Eigen::Vector2d a = at(u, v), d = at(u + 1, v + 1) - a;
        for (int k = 0; k * n * n < most_ / 8; ++k) wanted.push_back(a + (0.5 + 0.1 * (k % 3 - 1)) * d);
      }
    strew(edges, length / most_, reach_, wanted);
    look_at(wanted);
  }

  /// A place every `step` along the segments, at most `reach` beside them.
  static void strew(const std::vector<Segment>& segments, double step, double reach,
                    std::vector<Eigen::Vector2d>& places) {
    double across = 0, along = 0;
    for (const auto& [a, b] : segments) {
      const double l = (b - a).norm();
      const Eigen::Vector2d t = (b - a) / l, normal(-t.y(), t.x());
      for (; along < l; along += step) {
        places.push_back(a + along * t + (2 * across - 1) * reach * normal);
        across = std::fmod(across + 0.6180339887, 1.0);  // the golden section spreads them evenly
      }
      along -= l;
    }
  }

  void look_at(const std::vector<Eigen::Vector2d>& places) {
    Eigen::Array2d low = places.front(), high = low;
    for (const Eigen::Vector2d& place : places) low = low.min(place.array()), high = high.max(place.array());
    const int x0 = std::max(0, cell_of(low.x() + 0.5)), x1 = std::min(image_.width, cell_of(high.x() + 1.5));
    const int y0 = std::max(0, cell_of(low.y() + 0.5)), y1 = std::min(image_.height, cell_of(high.y() + 1.5));
    if (x0 >= x1 || y0 >= y1) return;
    const int width = x1 - x0;
    std::vector<char> seen(static_cast<std::size_t>(width) * static_cast<std::size_t>(y1 - y0), 0);
    for (const Eigen::Vector2d& place : places) {
      const int x = cell_of(place.x() + 0.5), y = cell_of(place.y() + 0.5);
      if (x < x0 || y < y0 || x >= x1 || y >= y1) continue;
      char& before = seen[static_cast<std::size_t>((y - y0) * width + x - x0)];
      if (!before) look(x, y);
      before = 1;  // a pixel counts once
    }
  }

  /// 0: of no use, 1: within `reach_` [px] of an edge, 2: on flat ground.
  int classify(const Cell& c) const {
    if (!(c.w > 0.05)) return 0;
    const double du = reach_cells_ * c.by_xy.row(0).norm(), dv = reach_cells_ * c.by_xy.row(1).norm();
    const double u = c.uv.x(), v = c.uv.y(), low = geometry_.lowest(), high = pattern_.cells - low;
    // Beyond the rim somebody else's paper begins: stay clear of it, yet keep half a cell.
    const double mu = std::min(0.5, du), mv = std::min(0.5, dv);
    if (u < low + mu || u > high - mu || v < low + mv || v > high - mv) return 0;
    const double eu = std::min(du, 1.0), ev = std::min(dv, 1.0);
    if (edge_within(u, v, eu, ev)) return 1;
    return edge_within(u, v, 2 * eu, 2 * ev) ? 0 : 2;
  }

  /// Whether the grey changes from (u, v) to a place du to either side, or dv above or below.
  bool edge_within(double u, double v, double du, double dv) const {
    const int row = cell_of(v), col = cell_of(u);
    const int left = cell_of(u - du), right = cell_of(u + du), above = cell_of(v - dv), below = cell_of(v + dv);
    if (left == right && above == below) return false;
    const bool here = pattern_.at(row, col);
    return pattern_.at(row, left) != here || pattern_.at(row, right) != here || pattern_.at(above, col) != here ||
           pattern_.at(below, col) != here;
  }

  bool cell(double u, double v) const { return pattern_.at(cell_of(v), cell_of(u)); }

  static void thin(std::vector<Sample>& list, int most) {
    const auto n = list.size(), keep = static_cast<std::size_t>(most);
    if (n <= keep) return;
    for (std::size_t i = 0; i < keep; ++i) list[i] = list[i * n / keep];
    list.resize(keep);
  }

  const ImageView& image_;
  const MarkerPattern& pattern_;
  const Geometry& geometry_;
  const Vector& p_;
  double reach_, reach_cells_;
  int most_;
  std::vector<Sample> edge_, flat_;
  std::vector<double> black_, white_;
};

}  // namespace

std::vector<Sample> choose_pixels(const ImageView& image, const MarkerPattern& pattern, const Geometry& geometry,
                                  Vector& p, const Corners& corners, double reach, int most) {
  PixelChoice choice(image, pattern, geometry, p, reach, most);
  choice.look_around(corners);
  if (p[10] == 0.0) choice.set_greys(p);
  return choice.pixels();
}

}  // namespace kr5::vision::marker
