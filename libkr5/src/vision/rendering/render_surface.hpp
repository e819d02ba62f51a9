// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "vision/rendering/render_sheets.hpp"

/// @file
/// Rays meet sheets.

namespace kr5::vision {

inline constexpr float nothing = -1.0f;  ///< A ray that meets no sheet.

/// Where a ray meets a sheet, in cells; `depth` along the ray, not positive when it misses the plane.
struct Hit {
  double u, v, depth;
};

/// A sheet with the homography from rays (x, y, 1) to its cells.
struct Surface {
  Sheet sheet;
  Eigen::Matrix3d to_cells;
  double distance = 0;  ///< From the camera to the plane, along its normal [m].

  explicit Surface(Sheet s) : sheet(std::move(s)) {
    const Eigen::Matrix3d R = sheet.T_camera_sheet.linear();
    const Eigen::Vector3d t = sheet.T_camera_sheet.translation(), n = R.col(2);
    distance = n.dot(t);
    for (int k = 0; k < 2; ++k)
      to_cells.row(k) = (distance * R.col(k) - R.col(k).dot(t) * n).transpose() / sheet.cell[k];
    to_cells.row(2) = n.transpose();
  }

  Hit hit(const Eigen::Vector3d& ray) const {
    const Eigen::Vector3d h = to_cells * ray;
    return {h.x() / h.z(), h.y() / h.z(), distance / h.z()};
  }

  float grey(const Hit& at) const {
    if (!(at.depth > 0) || !(at.u >= 0 && at.v >= 0 && at.u < sheet.cols && at.v < sheet.rows)) return nothing;
    if (sheet.disc && std::hypot(at.u - 0.5, at.v - 0.5) > 0.5) return nothing;
    return sheet.grey[static_cast<std::size_t>(at.v) * sheet.cols + static_cast<std::size_t>(at.u)];
  }

  /// True when an edge may cross the quadrilateral with these corners.
  bool may_have_edge(const std::array<Hit, 4>& corners) const {
    double u0 = corners[0].u, u1 = u0, v0 = corners[0].v, v1 = v0;
    int in_front = 0;
    for (const Hit& c : corners) {
      u0 = std::min(u0, c.u), u1 = std::max(u1, c.u), v0 = std::min(v0, c.v), v1 = std::max(v1, c.v);
      in_front += c.depth > 0;
    }
    if (in_front < 4) return in_front > 0;
    if (u1 < 0 || v1 < 0 || u0 > sheet.cols || v0 > sheet.rows) return false;
    if (u0 < 0 || v0 < 0 || u1 >= sheet.cols || v1 >= sheet.rows) return true;
    return sheet.disc ? disc_edge(u0, u1, v0, v1) : cell_edge(u0, u1, v0, v1);
  }

 private:
  static bool disc_edge(double u0, double u1, double v0, double v1) {
    const double far = std::hypot(std::max(0.5 - u0, u1 - 0.5), std::max(0.5 - v0, v1 - 0.5));
    const double near = std::hypot(std::max({u0 - 0.5, 0.5 - u1, 0.0}), std::max({v0 - 0.5, 0.5 - v1, 0.0}));
    return near <= 0.5 && far >= 0.5;
  }
  bool cell_edge(double u0, double u1, double v0, double v1) const {
    const int i0 = static_cast<int>(v0), i1 = static_cast<int>(v1), j0 = static_cast<int>(u0),
              j1 = static_cast<int>(u1);
    for (int i = i0; i <= i1; ++i)
      for (int j = j0; j <= j1; ++j)
        if (sheet.grey[i * sheet.cols + j] != sheet.grey[i0 * sheet.cols + j0]) return true;
    return false;
  }
};

}  // namespace kr5::vision
