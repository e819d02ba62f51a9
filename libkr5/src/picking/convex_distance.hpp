// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <limits>

#include <Eigen/Dense>

namespace kr5::picking {

/// Bounds of the distance of two convex bodies.
struct DistanceBounds {
  double lower = 0.0;
  double upper = 0.0;
};

/// The point nearest to the origin of the convex hull of up to four points, which are cut down to those that carry it.
struct NearestSimplex {
  std::array<Eigen::Vector3d, 4> points;
  int count = 0;

  Eigen::Vector3d reduce() {
    double least = std::numeric_limits<double>::infinity();
    Eigen::Vector3d nearest = points[0];
    int best = 1;
    for (int set = 1; set < (1 << count); ++set) {
      std::array<int, 4> of{};
      int size = 0;
      for (int i = 0; i < count; ++i)
        if (set >> i & 1) of[static_cast<std::size_t>(size++)] = i;
      Eigen::Vector3d v = point(of[0]);
      if (size > 1) {  // base point and edges: weights of the edges
        Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 3> edges(3, size - 1);
        for (int i = 1; i < size; ++i) edges.col(i - 1) = point(of[static_cast<std::size_t>(i)]) - v;
        const Eigen::VectorXd weights = edges.colPivHouseholderQr().solve(-v);
        if (!(weights.array() >= 0).all() || weights.sum() > 1) continue;
        v += edges * weights;
      }
      if (v.squaredNorm() < least) {
        least = v.squaredNorm();
        nearest = v;
        best = set;
      }
    }
    int kept = 0;
    for (int i = 0; i < count; ++i)
      if (best >> i & 1) points[static_cast<std::size_t>(kept++)] = point(i);
    count = kept;
    return nearest;
  }

 private:
  const Eigen::Vector3d& point(int i) const { return points[static_cast<std::size_t>(i)]; }
};

/// Gilbert, Johnson and Keerthi (1988). `support(d)` gives the point of the difference of the bodies, first less
/// second, that lies furthest along d. The lower bound is that of the planes found on the way, and so holds wherever it
/// stops.
template <class Support>
DistanceBounds convex_distance(Support&& support, double tolerance = 1e-9) {
  NearestSimplex simplex;
  Eigen::Vector3d v = support(Eigen::Vector3d(1, 0, 0));
  DistanceBounds out{0.0, v.norm()};
  for (int iteration = 0; iteration < 200; ++iteration) {
    const double length = v.norm();
    out.upper = std::min(out.upper, length);
    if (length < tolerance) return {0.0, length};
    const Eigen::Vector3d w = support(-v);
    out.lower = std::max(out.lower, v.dot(w) / length);
    if (out.upper - out.lower <= tolerance * std::max(1.0, out.upper)) break;
    if (simplex.count == 4) break;  // rounding: the origin is as near as it gets
    simplex.points[static_cast<std::size_t>(simplex.count++)] = w;
    v = simplex.reduce();
    if (simplex.count == 4) return {0.0, 0.0};  // the origin lies within
  }
  return out;
}

}  // namespace kr5::picking
