#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>

#include <kr5/core/random.hpp>
#include <kr5/geometry/image_view.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/picking/pellets.hpp>

namespace kr5::test {

/// Cylinders on a floor before a camera, rendered by rays: low contrast, and a bright streak along the top of a side.
struct PelletScene {
  std::vector<picking::Pellet> pellets;
  Pinhole camera;
  Pose T_camera_base = Pose::Identity();
  double floor = 33, body = 42, shading = 12;  ///< [grey]
  double streak = 0;                           ///< [grey]
  bool flat = false;                           ///< Each surface of one grey level, so that no shading moves its edges.
  Eigen::Vector3d light = Eigen::Vector3d(0.4, 0.25, 0.88).normalized();

  double seen_along(const Eigen::Vector3d& eye, const Eigen::Vector3d& ray) const {
    double nearest = std::numeric_limits<double>::infinity(), grey = floor;
    for (const auto& p : pellets) {
      const Eigen::Vector3d o = p.frame.transpose() * (eye - p.centre), d = p.frame.transpose() * ray;
      const auto take = [&](double s, const Eigen::Vector3d& normal, bool side) {
        if (!(s > 0 && s < nearest)) return;
        nearest = s;
        const Eigen::Vector3d n = p.frame * normal;
        grey = body + shading * (flat ? (side ? 0.4 : 0.9) : std::max(0.0, n.dot(light)));
        const Eigen::Vector3d half = light - ray, across = half - half.dot(p.axis) * p.axis;
        if (side && n.dot(across.normalized()) > 0.995) grey += streak;
      };
      const double a = d.head<2>().squaredNorm(), b = o.head<2>().dot(d.head<2>());
      const double root = b * b - a * (o.head<2>().squaredNorm() - p.radius * p.radius);
      if (root > 0) {
        const double s = (-b - std::sqrt(root)) / a;
        const Eigen::Vector3d q = o + s * d;
        if (std::abs(q.z()) <= p.height / 2) take(s, Eigen::Vector3d(q.x(), q.y(), 0) / p.radius, true);
      }
      for (const double end : {-1.0, 1.0}) {
        const double s = (end * p.height / 2 - o.z()) / d.z();
        const Eigen::Vector3d q = o + s * d;
        if (q.head<2>().norm() <= p.radius && end * d.z() < 0) take(s, end * Eigen::Vector3d::UnitZ(), false);
      }
    }
    return grey;
  }

  /// Mean grey level of each pixel, 4 x 4 rays each.
  Eigen::MatrixXd render() const {
    const Pose T_base_camera = T_camera_base.inverse();
    const Eigen::Vector3d eye = T_base_camera.translation();
    return Eigen::MatrixXd::NullaryExpr(camera.height, camera.width, [&](Eigen::Index v, Eigen::Index u) {
      double sum = 0;
      for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j) {
          const Eigen::Vector2d pixel(double(u) + (i - 1.5) / 4, double(v) + (j - 1.5) / 4);
          sum += seen_along(eye, T_base_camera.linear() * camera.ray(pixel)->normalized());
        }
      return sum / 16;
    });
  }
};

/// An image with noise [grey], owned.
struct NoisyImage {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;

  NoisyImage(const Eigen::MatrixXd& grey, Random& random, double noise)
      : width(static_cast<int>(grey.cols())), height(static_cast<int>(grey.rows())) {
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u)
        pixels.push_back(
            static_cast<std::uint8_t>(std::clamp(std::lround(grey(v, u) + random.normal(noise)), 0L, 255L)));
  }
  ImageView view() const { return {pixels.data(), width, height, width}; }
};

/// A camera 0.22 m above the floor that looks down with a lean.
inline PelletScene scene_of(const std::vector<picking::Pellet>& pellets) {
  PelletScene out{.pellets = pellets, .camera = {}};
  out.camera.width = 280, out.camera.height = 220;
  out.camera.fx = out.camera.fy = 1400, out.camera.cx = 139.5, out.camera.cy = 109.5;
  out.camera.k1 = -0.1;
  Pose T_base_camera(Eigen::Translation3d(0.01, -0.04, 0.22));
  T_base_camera.rotate(Eigen::AngleAxisd(std::numbers::pi + 0.19, Eigen::Vector3d::UnitX()));
  out.T_camera_base = T_base_camera.inverse();
  return out;
}

/// Lying on the floor, its axis at an angle to X.
inline picking::Pellet lying(const Eigen::Vector2d& at, double angle, double height = 0.015) {
  picking::Pellet out;
  out.radius = 0.008, out.height = height;
  out.centre = Eigen::Vector3d(at.x(), at.y(), out.radius);
  out.axis = Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
  out.frame.col(2) = out.axis;
  out.frame.col(0) = Eigen::Vector3d::UnitZ().cross(out.axis);
  out.frame.col(1) = Eigen::Vector3d::UnitZ();
  return out;
}

using PelletErrors = Eigen::Matrix<double, 7, 1>;

/// A cylinder with errors along its frame: centre, two tilts, radius, height.
inline picking::Pellet displaced(picking::Pellet pellet, const PelletErrors& errors) {
  pellet.centre += pellet.frame * errors.head<3>();
  pellet.frame = pellet.frame * exp_rotation({errors[3], errors[4], 0});
  pellet.axis = pellet.frame.col(2);
  pellet.radius += errors[5];
  pellet.height += errors[6];
  return pellet;
}

/// What an estimate is off, along its frame.
inline PelletErrors errors_of(const picking::Pellet& found, const picking::Pellet& truth) {
  PelletErrors out;
  out.head<3>() = found.frame.transpose() * (found.centre - truth.centre);
  out.segment<2>(3) = log_rotation(truth.frame.transpose() * found.frame).head<2>();
  out[5] = found.radius - truth.radius;
  out[6] = found.height - truth.height;
  return out;
}

}  // namespace kr5::test
