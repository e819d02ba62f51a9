// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include <kr5/calibration/hand_eye.hpp>
#include <kr5/core/random.hpp>

/// @file
/// A synthetic cell: an arm, a camera and a flat target whose true places are known, and what it would record.

namespace kr5::test {

struct HandEyeWorldOptions {
  Mount mount = Mount::EyeInHand;
  int views = 15;
  int rows = 6, cols = 9;             ///< Points of the target.
  double square = 0.03;               ///< [m]
  double sigma_pixel = 0.2;           ///< [px]
  double sigma_robot_position = 0.0;  ///< [m]
  double sigma_robot_rotation = 0.0;  ///< [rad]
  double near = 0.45, far = 0.8;      ///< Distance of camera and target [m].
  double tilt = 0.6;                  ///< Largest tilt of the target against the line of sight [rad].
  int axes = 3;                       ///< 3: the wrist turns every way; 1: about one axis only; 0: never.
  std::uint64_t seed = 1;
};

struct HandEyeWorld {
  Pinhole camera;
  Pose T_mount_camera = Pose::Identity();
  Pose T_fixed_target = Pose::Identity();
  std::vector<calibration::HandEyeView> views;  ///< As recorded: noisy robot poses, noisy pixels.
  std::vector<Pose> T_base_flange;              ///< True robot poses.
};

inline Pinhole world_camera() {
  Pinhole c{.width = 1280, .height = 960, .fx = 1100, .fy = 1098, .cx = 645, .cy = 478};
  c.k1 = -0.12, c.k2 = 0.05, c.p1 = 2e-4, c.p2 = -3e-4;
  return c;
}

/// Points of a flat board, ids row by row.
inline Eigen::Matrix3Xd board_points(int rows, int cols, double square) {
  Eigen::Matrix3Xd points(3, rows * cols);
  for (int row = 0; row < rows; ++row) {
    for (int col = 0; col < cols; ++col) points.col(row * cols + col) << square * col, square * row, 0.0;
  }
  return points;
}

/// True pose of the flange when the camera sees the target at T_camera_target.
inline Pose flange_for(const HandEyeWorld& w, Mount mount, const Pose& T_camera_target) {
  return mount == Mount::EyeInHand ? w.T_fixed_target * T_camera_target.inverse() * w.T_mount_camera.inverse()
                                   : w.T_mount_camera * T_camera_target * w.T_fixed_target.inverse();
}

/// Where the camera would see the target when the flange is at T_base_flange.
inline Pose target_in_camera(const HandEyeWorld& w, Mount mount, const Pose& T_base_flange) {
  const Pose T_mount_fixed = mount == Mount::EyeInHand ? T_base_flange.inverse() : T_base_flange;
  return w.T_mount_camera.inverse() * T_mount_fixed * w.T_fixed_target;
}

namespace detail {

inline Pose random_pose(Random& random, const Vector6& middle, double position, double rotation) {
  Vector6 d;
  d << random.normal_vector(3, position), random.normal_vector(3, rotation);
  return from_xyzrpy(middle) * to_pose(d);
}

/// A pose of the target in the camera with every point in the image.
inline Pose random_target_pose(Random& random, const HandEyeWorldOptions& o, const Pinhole& camera,
                               const Eigen::Matrix3Xd& points) {
  const Eigen::Vector3d middle = points.rowwise().mean();
  for (;;) {
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    if (o.axes >= 1) R = exp_rotation(Eigen::Vector3d(0, 0, random.uniform(-2.5, 2.5)));
    if (o.axes == 3) {
      const double way = random.uniform(0, 2 * std::numbers::pi), tilt = o.tilt * std::sqrt(random.uniform());
      R = exp_rotation(tilt * Eigen::Vector3d(std::cos(way), std::sin(way), 0)) * R;
    }
    const double z = random.uniform(o.near, o.far);
    Pose T = Pose::Identity();
    T.linear() = R;
    T.translation() = Eigen::Vector3d(random.uniform(-0.3, 0.3) * z, random.uniform(-0.25, 0.25) * z, z) - R * middle;
    bool inside = true;
    for (int i = 0; i < points.cols() && inside; ++i) {
      const Eigen::Vector2d p = camera.project(T * points.col(i));
      inside = p.x() > 5 && p.y() > 5 && p.x() < camera.width - 6 && p.y() < camera.height - 6;
    }
    if (inside) return T;
  }
}

}  // namespace detail

/// What the camera records of `points` at T_camera_target.
inline View see(Random& random, const Pinhole& camera, const Eigen::Matrix3Xd& points, const Pose& T_camera_target,
                double sigma_pixel, std::string name) {
  View view{.name = std::move(name), .points = points, .pixels = Eigen::Matrix2Xd(2, points.cols()), .ids = {}};
  for (int i = 0; i < points.cols(); ++i) {
    view.pixels.col(i) = camera.project(T_camera_target * points.col(i)) + random.normal_vector(2, sigma_pixel);
    view.ids.push_back(i);
  }
  return view;
}

/// Records a cell: the true flange pose is the reported one times to_pose(e), e normal with the given deviations.
inline HandEyeWorld make_hand_eye_world(const HandEyeWorldOptions& o = {}) {
  Random random(o.seed);
  HandEyeWorld w;
  w.camera = world_camera();
  const bool in_hand = o.mount == Mount::EyeInHand;
  Vector6 mount, fixed;
  if (in_hand) {
    mount << 0.05, -0.03, 0.08, 0.1, -0.15, 1.6;
    fixed << 0.7, 0.1, 0.05, 3.1, 0.05, 0.4;
  } else {
    mount << 1.2, 0.3, 0.6, -1.8, 0.1, 1.2;
    fixed << 0.02, -0.04, 0.09, 0.1, 0.05, -0.7;
  }
  w.T_mount_camera = detail::random_pose(random, mount, 0.02, 0.1);
  w.T_fixed_target = detail::random_pose(random, fixed, 0.03, 0.1);
  const Eigen::Matrix3Xd points = board_points(o.rows, o.cols, o.square);
  for (int i = 0; i < o.views; ++i) {
    const Pose T_camera_target = detail::random_target_pose(random, o, w.camera, points);
    w.T_base_flange.push_back(flange_for(w, o.mount, T_camera_target));
    Vector6 e;
    e << random.normal_vector(3, o.sigma_robot_position), random.normal_vector(3, o.sigma_robot_rotation);
    w.views.push_back({w.T_base_flange.back() * to_pose(e).inverse(),
                       see(random, w.camera, points, T_camera_target, o.sigma_pixel, "view" + std::to_string(i))});
  }
  return w;
}

}  // namespace kr5::test
