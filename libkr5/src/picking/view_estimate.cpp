// SPDX-License-Identifier: BSD-3-Clause
#include "view_estimate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_set>
#include <vector>

namespace kr5::picking {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

/// Rays over the bin. Along X and along Y: the slope of the ray through the origin, and one over the height of the
/// place (or line) they come from.
struct View {
  std::array<double, 4> x{};  // slopes [-], then inverse heights [1/m]

  Vector2d slope(const Vector3d& p) const {
    return {(x[0] + p.x() * x[2]) / std::max(1 - p.z() * x[2], 0.1),
            (x[1] + p.y() * x[3]) / std::max(1 - p.z() * x[3], 0.1)};
  }
};

/// Counts of points that others would hide, with one table for all counts.
class HiddenPoints {
 public:
  HiddenPoints(const Matrix3Xd& points, double spacing, double step) : cell_(1.5 * spacing), step_(step) {
    std::unordered_set<std::int64_t> squares;
    for (Index i = 0; i < points.cols(); ++i) {
      const Vector3d p = points.col(i);
      if (!p.allFinite()) continue;
      const auto u = static_cast<std::int64_t>(std::floor(p.x() / spacing));
      const auto v = static_cast<std::int64_t>(std::floor(p.y() / spacing));
      const auto w = static_cast<std::int64_t>(std::floor(p.z() / step));  // both where one lies above the other
      if (squares.insert((u & 0x1fffff) << 42 | (v & 0x1fffff) << 21 | (w & 0x1fffff)).second) points_.push_back(p);
    }
    Vector2d low = Vector2d::Zero(), high = Vector2d::Zero();
    for (const Vector3d& p : points_) low = low.cwiseMin(p.head<2>()), high = high.cwiseMax(p.head<2>());
    low_ = low - Vector2d::Constant(margin);
    side_ = static_cast<int>(((high - low).maxCoeff() + 2 * margin) / cell_) + 1;
    top_.resize(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_));
  }

  int count(const View& view) {
    std::fill(top_.begin(), top_.end(), -std::numeric_limits<float>::infinity());
    for (const Vector3d& p : points_) {
      float& top = top_[place(view, p)];
      top = std::max(top, static_cast<float>(p.z()));
    }
    int out = 0;
    for (const Vector3d& p : points_) out += covered(place(view, p), static_cast<float>(p.z() + step_));
    return out;
  }

 private:
  /// Whether all points about a cell lie higher: beside a steep surface, which is seen, some do not.
  bool covered(std::size_t cell, float height) const {
    if (top_[cell] <= height) return false;
    const auto side = static_cast<std::size_t>(side_);
    const std::size_t u = cell / side, v = cell % side;
    if (u == 0 || v == 0 || u + 1 == side || v + 1 == side) return false;
    for (const std::size_t row : {cell - side, cell, cell + side})
      if (top_[row - 1] <= height || top_[row] <= height || top_[row + 1] <= height) return false;
    return true;
  }

  static constexpr double margin = 0.1;  // how far a slope may move a point [m]

  std::size_t place(const View& view, const Vector3d& p) const {
    const Vector2d at = (p.head<2>() + view.slope(p) * p.z() - low_) / cell_;
    const int u = std::clamp(static_cast<int>(at.x()), 0, side_ - 1),
              v = std::clamp(static_cast<int>(at.y()), 0, side_ - 1);
    return static_cast<std::size_t>(u) * static_cast<std::size_t>(side_) + static_cast<std::size_t>(v);
  }

  std::vector<Vector3d> points_;
  std::vector<float> top_;
  Vector2d low_;
  double cell_, step_;
  int side_ = 1;
};

View best_view(HiddenPoints& hidden) {
  View best;
  double least = hidden.count(best);
  const auto try_view = [&](const View& view) {
    double steepness = 0;  // of equals, the one nearest to straight from far above
    for (const double value : view.x) steepness += std::abs(value);
    const double score = hidden.count(view) + 0.1 * steepness;
    if (score < least) least = score, best = view;
  };
  for (const double sx : {-0.6, -0.3, 0.0, 0.3, 0.6})
    for (const double sy : {-0.6, -0.3, 0.0, 0.3, 0.6}) try_view({{sx, sy, 0, 0}});
  for (const double k : {1.0, 2.0, 3.0}) {
    const View from = best;
    try_view({{from.x[0], from.x[1], k, k}});
    try_view({{from.x[0], from.x[1], k, from.x[3]}});
    try_view({{from.x[0], from.x[1], from.x[2], k}});
  }
  for (double scale = 1; scale > 0.06; scale /= 2)
    for (int round = 0; round < 2; ++round)
      for (std::size_t i = 0; i < 4; ++i)
        for (const double sign : {-1.0, 1.0}) {
          View view = best;
          view.x[i] += sign * scale * (i < 2 ? 0.15 : 0.8);
          if (i >= 2) view.x[i] = std::clamp(view.x[i], 0.0, 5.0);
          try_view(view);
        }
  return best;
}

}  // namespace

Matrix3Xd estimated_origins(const Cloud& cloud, const Bin& bin, double spacing, double step) {
  const Matrix3Xd local = bin.T_base_bin.inverse() * cloud.points;
  HiddenPoints hidden(local, spacing, step);
  const View view = best_view(hidden);
  Matrix3Xd out(3, local.cols());
  for (Index i = 0; i < local.cols(); ++i) {
    if (!local.col(i).allFinite()) {
      out.col(i).setConstant(std::numeric_limits<double>::quiet_NaN());
      continue;
    }
    const Vector2d slope = view.slope(local.col(i));
    out.col(i) = bin.T_base_bin * Vector3d(local.col(i) + Vector3d(-slope.x(), -slope.y(), 1));
  }
  return out;
}

}  // namespace kr5::picking
