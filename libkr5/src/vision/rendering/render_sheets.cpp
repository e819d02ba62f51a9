// SPDX-License-Identifier: BSD-3-Clause
#include "vision/rendering/render_sheets.hpp"

#include <algorithm>

#include <kr5/core/error.hpp>
#include <kr5/vision/family.hpp>

namespace kr5::vision {
namespace {

using Eigen::Vector2d;

/// The pattern without a white rim, which is paper and must not cover a close neighbour.
MarkerPattern printed_pattern(const std::string& family, int id) {
  const MarkerPattern p = marker_pattern(family, id);
  MarkerPattern inner{p.cells - 2, p.square, {}};
  for (int i = 0; i < p.cells; ++i)
    for (int j = 0; j < p.cells; ++j) {
      const bool rim = i == 0 || j == 0 || i == p.cells - 1 || j == p.cells - 1;
      if (rim && !p.at(i, j)) return p;
      if (!rim) inner.white.push_back(p.at(i, j));
    }
  return inner;
}

/// Width of what a marker prints round its detected square [m].
double overhang(const MarkerPattern& pattern, double side) {
  return side * (pattern.cells - pattern.square) / (2.0 * pattern.square);
}

class Builder {
 public:
  explicit Builder(const RenderOptions& options) : o_(options) {}

  void paper(const Pose& T, const Vector2d& low, const Vector2d& high) {
    add(T, low, high - low, 1, 1, {static_cast<float>(o_.white)});
  }

  void marker(const Pose& T_camera_marker, const std::string& family, int id, double side) {
    const MarkerPattern p = printed_pattern(family, id);
    std::vector<float> grey;
    for (const auto white : p.white) grey.push_back(static_cast<float>(white ? o_.white : o_.black));
    add(T_camera_marker, Vector2d::Constant(-side / 2 - overhang(p, side)), Vector2d::Constant(side / p.square),
        p.cells, p.cells, std::move(grey));
  }

  void squares(const Pose& T, const Vector2d& corner, double side, int rows, int cols, bool first_white) {
    std::vector<float> grey;
    for (int i = 0; i < rows; ++i)
      for (int j = 0; j < cols; ++j)
        grey.push_back(static_cast<float>((i + j) % 2 == (first_white ? 0 : 1) ? o_.white : o_.black));
    add(T, corner, Vector2d::Constant(side), cols, rows, std::move(grey));
  }

  void dots(const Pose& T, const Target& t) {
    for (int k = 0; k < t.rows * t.cols; ++k) {
      const double d = t.size * o_.dot * (k == o_.big_dot ? o_.big_dot_factor : 1.0);
      const Vector2d centre = t.size * Vector2d(k % t.cols, k / t.cols);
      add(T, centre - Vector2d::Constant(d / 2), Vector2d::Constant(d), 1, 1, {static_cast<float>(o_.black)});
      sheets.back().disc = true;
    }
  }

  std::vector<Sheet> sheets;

 private:
  void add(const Pose& T, const Vector2d& corner, const Vector2d& cell, int cols, int rows, std::vector<float> grey) {
    Sheet sheet{T, cell, cols, rows, std::move(grey), false};
    sheet.T_camera_sheet.translation() += T.linear().leftCols<2>() * corner;
    const bool from_behind = sheet.T_camera_sheet.linear().col(2).dot(sheet.T_camera_sheet.translation()) <= 0;
    if (from_behind) std::fill(sheet.grey.begin(), sheet.grey.end(), static_cast<float>(o_.white));
    sheets.push_back(std::move(sheet));
  }

  const RenderOptions& o_;
};

/// White rim that every marker needs: one cell.
void map_paper(Builder& builder, const PlacedTarget& placed) {
  for (const MapMarker& m : placed.target.map) {
    const MarkerPattern p = printed_pattern(placed.target.family, m.id);
    const Vector2d half = Vector2d::Constant(m.size / 2 + overhang(p, m.size) + m.size / p.square);
    builder.paper(placed.T_camera_target * m.T_target_marker, -half, half);
  }
}

}  // namespace

Eigen::Matrix2d printed_area(const Target& t, const RenderOptions& options) {
  t.validate();
  require(t.kind != TargetKind::MarkerMap,
          "target: a marker map lies in space and has no printed area; print its markers one by one");
  Vector2d low = Vector2d::Zero(), high = t.size * Vector2d(t.cols, t.rows);
  if (t.kind == TargetKind::Chessboard) low.setConstant(-t.size);
  if (t.kind == TargetKind::CircleGrid) low.setConstant(-t.size / 2), high += low;
  if (t.kind == TargetKind::Tag || t.kind == TargetKind::TagGrid) {
    const Vector2d rim = Vector2d::Constant(overhang(printed_pattern(t.family, t.first_id), t.size));
    if (t.kind == TargetKind::Tag) low.setConstant(-t.size / 2), high = -low;
    if (t.kind == TargetKind::TagGrid) high = (t.size + t.gap) * Vector2d(t.cols, t.rows) - Vector2d::Constant(t.gap);
    low -= rim, high += rim;
  }
  Eigen::Matrix2d area;
  area << low, high;
  area.col(0).array() -= options.margin * t.size;
  area.col(1).array() += options.margin * t.size;
  return area;
}

std::vector<Sheet> sheets_of(const PlacedTarget& placed, const RenderOptions& options) {
  const Target& t = placed.target;
  const Pose& T = placed.T_camera_target;
  t.validate();
  Builder builder(options);
  if (t.kind == TargetKind::MarkerMap) {
    map_paper(builder, placed);  // all of it before the first marker: no rim may cover a neighbour
  } else {
    const Eigen::Matrix2d area = printed_area(t, options);
    builder.paper(T, area.col(0), area.col(1));
  }
  if (t.kind == TargetKind::Chessboard)
    builder.squares(T, Vector2d::Constant(-t.size), t.size, t.rows + 1, t.cols + 1, false);
  if (t.kind == TargetKind::Charuco)
    builder.squares(T, Vector2d::Zero(), t.size, t.rows, t.cols, t.legacy && t.rows % 2 == 0);
  if (t.kind == TargetKind::CircleGrid) builder.dots(T, t);
  for (const MapMarker& m : target_markers(t)) builder.marker(T * m.T_target_marker, t.family, m.id, m.size);
  return std::move(builder.sheets);
}

}  // namespace kr5::vision
