// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "vision/markers/refine_marker.hpp"

/// @file
/// How a marker lies in an image: homography and bend of the lens. What `refine_marker` fits, and what tells which
/// pixels are of use to that.

namespace kr5::vision::marker {

using Corners = Eigen::Matrix<double, 2, 4>;

// 8 of the homography, log of the blur, black, white - black, its slope along x, y, bends.
constexpr int size = 16, bends = 3;
// How the lens bends the marker: cubic distortion about the middle of the image, at half its diagonal; what distortion
// of higher order adds to that along the radius; and across it, because the lens's centre is not the image's.
constexpr int lens = 13;
constexpr double usual_blur = -0.2;  // log of the blur where an image cannot tell
using Vector = Eigen::Matrix<double, size, 1>;

/// Image to cells of the pattern: u = (g0 x + g1 y + g2) / (g6 x + g7 y + 1), v likewise, with x, y from the middle of
/// the marker in units of half its side.
struct Cell {
  Eigen::Vector2d uv;
  Eigen::Matrix2d by_xy;
  double w;  ///< denominator
};

inline Cell to_cell(const Vector& p, double x, double y) {
  const double w = p[6] * x + p[7] * y + 1, per_w = 1 / w;
  Cell c{{(p[0] * x + p[1] * y + p[2]) * per_w, (p[3] * x + p[4] * y + p[5]) * per_w}, {}, w};
  c.by_xy << (p[0] - p[6] * c.uv.x()) * per_w, (p[1] - p[7] * c.uv.x()) * per_w, (p[3] - p[6] * c.uv.y()) * per_w,
      (p[4] - p[7] * c.uv.y()) * per_w;
  return c;
}

/// Cell that holds a place; std::floor is a call of a function.
template <class T>
int cell_of(T place) {
  const int i = static_cast<int>(place);
  return i - (place < static_cast<T>(i));
}

/// A pixel, or a place between pixels.
struct Sample {
  double x, y;                           ///< From the middle of the marker, in units of half its side.
  Eigen::Matrix<double, 2, bends> bend;  ///< By how much a unit of each bend moves it, in the same units.
  double grey;
};

/// The frame of a marker in an image, fixed by the first guess of its corners.
class Geometry {
 public:
  Geometry(const ImageView& image, const MarkerPattern& pattern, const Corners& corners);

  /// Homography through the corners, usual blur, no bend, greys not known.
  Vector start(const Corners& corners) const;

  double half() const { return half_; }                    ///< [px] half the side
  int lowest() const { return lowest_; }                   ///< Row and column of the first cells that may be looked at.
  const Corners& square() const { return square_; }        ///< The corners in cells.
  const Eigen::Vector3d& usual() const { return usual_; }  ///< Deviation of the bends.

  static Eigen::Matrix3d to_image(const Vector& p);
  /// Where a place of the pattern lies, as bent by the lens; `H` is `to_image(p)`.
  Sample place(const Vector& p, const Eigen::Matrix3d& H, const Eigen::Vector2d& uv) const;
  Eigen::Vector2d pixel_of(const Sample& s) const { return middle_ + half_ * Eigen::Vector2d(s.x, s.y); }
  /// A place in the image, its grey not yet looked up.
  Sample sample(const Eigen::Vector2d& pixel) const;
  /// Where the sample would lie without the bend.
  static Sample straight(const Vector& p, Sample s) {
    const Eigen::Vector2d shift = s.bend * p.tail<bends>();
    s.x += shift.x(), s.y += shift.y();
    return s;
  }

 private:
  Eigen::Vector2d middle_, outward_ = Eigen::Vector2d::UnitX();  ///< Of the marker; there, along the image's radius.
  Eigen::Vector3d usual_;
  double half_, per_half_;
  double distance_;        ///< From the middle of the image, in `half_`.
  double cubic_, second_;  ///< Size of the bends.
  Corners square_;
  int lowest_;
};

}  // namespace kr5::vision::marker
