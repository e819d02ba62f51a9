// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <numbers>
#include <string>
#include <vector>

#include <kr5/core/random.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/geometry/view.hpp>

/// @file
/// A camera with known parameters, and what it sees of a flat board.

namespace kr5::test {

inline Pinhole true_camera() {
  Pinhole c{.width = 1280, .height = 960, .fx = 1100, .fy = 1100, .cx = 655, .cy = 470};
  c.k1 = -0.21, c.k2 = 0.09;
  return c;
}

struct Scene {
  int rows = 6, cols = 9;
  double size = 0.03;    ///< [m]
  double noise = 0.2;    ///< [px]
  double tilt = 0.6;     ///< Largest [rad].
  double bow = 0.0;      ///< Height of the board's middle [m].
  bool spatial = false;  ///< Points off the plane too.
};

inline Eigen::Matrix3Xd board_points(const Scene& s, bool as_built = false) {
  Eigen::Matrix3Xd points(3, s.rows * s.cols);
  const double half = 0.5 * (s.cols - 1);
  for (int r = 0; r < s.rows; ++r)
    for (int c = 0; c < s.cols; ++c) {
      const double x = (c - half) / half;
      const double z = (as_built ? s.bow * (1 - x * x) : 0.0) + (s.spatial ? s.size * ((r * 3 + c * 5) % 4) : 0.0);
      points.col(r * s.cols + c) << s.size * c, s.size * r, z;
    }
  return points;
}

/// A pose with the whole board in the image, at a random place, tilt, turn and distance.
inline Pose random_pose(Random& random, const Pinhole& c, const Scene& s) {
  const Eigen::Matrix3Xd points = board_points(s);
  for (;;) {
    const double bearing = random.uniform(0, 2 * std::numbers::pi), tilt = random.uniform(0, s.tilt);
    const Eigen::Vector3d axis(std::cos(bearing), std::sin(bearing), 0);
    Pose T = Pose::Identity();
    T.linear() = exp_rotation(tilt * axis) * exp_rotation(Eigen::Vector3d(0, 0, random.uniform(-0.6, 0.6)));
    const double distance = random.uniform(1.2, 2.5) * s.size * s.cols;
    T.translation() =
        Eigen::Vector3d(random.uniform(-0.4, 0.4) * distance, random.uniform(-0.3, 0.3) * distance, distance) -
        T.linear() * Eigen::Vector3d(points.rowwise().mean());
    bool inside = true;
    for (Eigen::Index i = 0; i < points.cols() && inside; ++i) {
      const Eigen::Vector2d q = c.project(T * Eigen::Vector3d(points.col(i)));
      inside = q.x() > 5 && q.y() > 5 && q.x() < c.width - 6 && q.y() < c.height - 6;
    }
    if (inside) return T;
  }
}

inline View see(Random& random, const Pinhole& c, const Scene& s, const Pose& T, const std::string& name) {
  const Eigen::Matrix3Xd built = board_points(s, true);
  View v{name, board_points(s), Eigen::Matrix2Xd(2, built.cols()), {}};
  for (Eigen::Index i = 0; i < built.cols(); ++i) {
    v.pixels.col(i) = c.project(T * Eigen::Vector3d(built.col(i)));
    for (int k = 0; k < 2; ++k) v.pixels(k, i) += random.normal(s.noise);
    v.ids.push_back(int(i));
  }
  return v;
}

inline std::vector<View> see_many(Random& random, const Pinhole& c, const Scene& s, int count) {
  std::vector<View> views;
  for (int i = 0; i < count; ++i)
    views.push_back(see(random, c, s, random_pose(random, c, s), "view" + std::to_string(i)));
  return views;
}

}  // namespace kr5::test
