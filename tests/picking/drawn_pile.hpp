// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include <kr5/core/random.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/picking/bin.hpp>
#include <kr5/picking/cloud.hpp>

namespace kr5::test {

/// A cylinder of a pile, and the share of it that is seen from above.
struct TrueCylinder {
  Pose T_bin_cylinder = Pose::Identity();
  double radius = 0.0, height = 0.0, exposed = 0.0;
};

/// A pile as seen from straight above, in the frame of a bin.
struct DrawnPile {
  picking::Bin bin;
  picking::Cloud cloud;
  std::vector<TrueCylinder> cylinders;
};

struct PileOptions {
  int count = 30;
  double side = 0.1, pitch = 0.0008, noise = 5e-5, radius = 0.008, radius_spread = 0.0, low = 0.014, high = 0.017;
  Pose T_base_bin = Pose::Identity();
  std::optional<double> tilt = std::nullopt;            ///< Of all; by default drawn [rad].
  std::optional<Eigen::Vector2d> place = std::nullopt;  ///< Of all; by default drawn [m].
};

/// Cylinders let down one after the other, upright, lying or leaning, until they touch what is there: no physics, but
/// the same touching and hiding. Heights on a grid, intersected by a method of their own.
inline DrawnPile drawn_pile(int seed, const PileOptions& options = {}) {
  Random random(static_cast<std::uint64_t>(seed));
  const int n = static_cast<int>(options.side / options.pitch);
  std::vector<double> top(static_cast<std::size_t>(n * n), 0.0);
  std::vector<int> owner(top.size(), -1);
  DrawnPile out;
  std::vector<int> area;
  for (int number = 0; number < options.count; ++number) {
    TrueCylinder c;
    c.radius = options.radius + random.uniform(-options.radius_spread, options.radius_spread);
    c.height = random.uniform(options.low, options.high);
    const double kind = random.uniform();
    const Eigen::Vector3d d = random.direction();
    const double tilt = options.tilt  ? *options.tilt
                        : kind < 0.4  ? std::numbers::pi / 2
                        : kind < 0.65 ? 0.0
                                      : std::acos(std::clamp(std::abs(d.z()), 0.0, 1.0));
    const double turn = random.uniform(0, 2 * std::numbers::pi);
    c.T_bin_cylinder.linear() = exp_rotation({0, 0, turn}) * exp_rotation({0, tilt + random.normal(1e-4), 0});
    const Eigen::Vector3d a = c.T_bin_cylinder.linear().col(2);
    const double reach = std::hypot(c.radius, c.height / 2), free = options.side / 2 - reach;
    const double drawn_x = random.uniform(-free, free), drawn_y = random.uniform(-free, free);
    const Eigen::Vector2d place = options.place.value_or(Eigen::Vector2d(drawn_x, drawn_y));
    const double x = place.x(), y = place.y();
    struct Column {
      std::size_t cell;
      double low, high;
    };
    std::vector<Column> columns;
    double rest = -std::numeric_limits<double>::infinity();
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < n; ++k) {
        const double px = (i + 0.5) * options.pitch - options.side / 2 - x;
        const double py = (k + 0.5) * options.pitch - options.side / 2 - y;
        if (std::abs(px) > reach || std::abs(py) > reach) continue;
        // |p - a (a.p)|^2 = r^2 and |a.p| <= h/2 on the vertical through (px, py)
        const double A = 1 - a.z() * a.z(), s = a.x() * px + a.y() * py;
        const double B = -a.z() * s, C = px * px + py * py - s * s - c.radius * c.radius;
        double low = -1e9, high = 1e9;
        if (A > 1e-12) {
          const double D = B * B - A * C;
          if (D <= 0) continue;
          low = (-B - std::sqrt(D)) / A, high = (-B + std::sqrt(D)) / A;
        } else if (C > 0) {
          continue;
        }
        if (std::abs(a.z()) > 1e-9) {
          const double e1 = (-c.height / 2 - s) / a.z(), e2 = (c.height / 2 - s) / a.z();
          low = std::max(low, std::min(e1, e2)), high = std::min(high, std::max(e1, e2));
        } else if (std::abs(s) > c.height / 2) {
          continue;
        }
        if (low >= high) continue;
        const auto cell = static_cast<std::size_t>(i * n + k);
        columns.push_back({cell, low, high});
        rest = std::max(rest, top[cell] - low);
      }
    c.T_bin_cylinder.translation() = Eigen::Vector3d(x, y, rest);
    for (const Column& column : columns)
      if (column.high + rest > top[column.cell]) top[column.cell] = column.high + rest, owner[column.cell] = number;
    area.push_back(static_cast<int>(columns.size()));
    out.cylinders.push_back(c);
  }
  std::vector<int> seen(out.cylinders.size(), 0);
  out.cloud.points.resize(3, n * n);
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < n; ++k) {
      const auto cell = static_cast<std::size_t>(i * n + k);
      if (owner[cell] >= 0) ++seen[static_cast<std::size_t>(owner[cell])];
      out.cloud.points.col(i * n + k) =
          options.T_base_bin * Eigen::Vector3d((i + 0.5) * options.pitch - options.side / 2,
                                               (k + 0.5) * options.pitch - options.side / 2,
                                               top[cell] + random.normal(options.noise));
    }
  for (std::size_t i = 0; i < seen.size(); ++i) out.cylinders[i].exposed = seen[i] / static_cast<double>(area[i]);
  out.bin.T_base_bin = options.T_base_bin;
  out.bin.size = {options.side, options.side, 0.1};
  return out;
}

}  // namespace kr5::test
