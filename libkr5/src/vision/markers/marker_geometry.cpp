// SPDX-License-Identifier: BSD-3-Clause
#include "vision/markers/marker_geometry.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace kr5::vision::marker {
namespace {

// What lenses are like, for markers too small to tell: deviation of the bends; the second grows with the cube of the
// distance from the middle.
constexpr double usual_lens = 0.1, usual_higher = 0.1, usual_across = 0.005;

/// Homography through four pairs of points, last entry 1.
Eigen::Matrix<double, 8, 1> through(const Corners& from, const Corners& to) {
  Eigen::Matrix<double, 8, 8> A = Eigen::Matrix<double, 8, 8>::Zero();
  Eigen::Matrix<double, 8, 1> b;
  for (int i = 0; i < 4; ++i) {
    const double x = from(0, i), y = from(1, i), u = to(0, i), v = to(1, i);
    A.row(2 * i) << x, y, 1, 0, 0, 0, -u * x, -u * y;
    A.row(2 * i + 1) << 0, 0, 0, x, y, 1, -v * x, -v * y;
    b.segment<2>(2 * i) << u, v;
  }
  return A.fullPivLu().solve(b);
}

}  // namespace

Geometry::Geometry(const ImageView& image, const MarkerPattern& pattern, const Corners& corners)
    : middle_(corners.rowwise().mean()) {
  const Eigen::Vector2d centre((image.width - 1) / 2.0, (image.height - 1) / 2.0);
  half_ = 0.25 * ((corners.col(1) - corners.col(0)).norm() + (corners.col(2) - corners.col(1)).norm());
  const int rim = (pattern.cells - pattern.square) / 2;
  square_ << rim, rim + pattern.square, rim + pattern.square, rim, rim, rim, rim + pattern.square, rim + pattern.square;
  lowest_ = std::min(0, rim - 1);
  const Eigen::Vector2d m = middle_ - centre;
  if (m.norm() > 1) outward_ = m.normalized();
  usual_ << usual_lens, usual_higher * std::max(std::pow(m.norm() / centre.norm(), 3), 0.01), usual_across;
  per_half_ = 1 / half_;
  distance_ = m.norm() * per_half_;
  second_ = half_ / centre.norm();
  cubic_ = second_ * second_;
}

Vector Geometry::start(const Corners& corners) const {
  Vector p;
  p.head<8>() = through((corners.colwise() - middle_) / half_, square_);
  p[8] = usual_blur;
  p.tail<size - 9>().setZero();
  return p;
}

Eigen::Matrix3d Geometry::to_image(const Vector& p) {
  Eigen::Matrix3d G;
  G << p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], 1;
  return G.inverse();
}

Sample Geometry::place(const Vector& p, const Eigen::Matrix3d& H, const Eigen::Vector2d& uv) const {
  const Eigen::Vector2d xy = (H * uv.homogeneous()).hnormalized();
  Sample at = sample(middle_ + half_ * xy);
  for (int pass = 0; pass < 4; ++pass)  // the pixel that, made straight, lies at xy
    at = sample(middle_ + half_ * (xy - at.bend * p.tail<bends>()));
  return at;
}

Sample Geometry::sample(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d xy = (pixel - middle_) * per_half_;
  const double out = outward_.dot(xy), squared = xy.squaredNorm();
  Sample s{xy.x(), xy.y(), {}, 0.0};
  // The cube of the distance from the image's middle, without its value and slope at the marker's middle, which the
  // homography has as well: what is left bends.
  s.bend.col(0) = cubic_ * ((2 * distance_ * out + squared) * xy + distance_ * squared * outward_);
  s.bend.col(1) = second_ * out * out * outward_;
  s.bend.col(2) = second_ * squared * Eigen::Vector2d(-outward_.y(), outward_.x());
  return s;
}

}  // namespace kr5::vision::marker
