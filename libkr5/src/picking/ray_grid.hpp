// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Core>

#include <kr5/picking/cloud.hpp>

namespace kr5::picking {

/// The rays of a cloud, sorted by where they cross a plane square to the mean of their directions: those that pass near
/// a solid are found without looking at the others.
class RayGrid {
 public:
  struct Ray {
    Eigen::Vector3d point;      ///< Where it ended.
    Eigen::Vector3d direction;  ///< From the sensor, of length 1.
    Eigen::Vector2d crossing;   ///< Of the plane.
    int column;                 ///< Of the cloud.
  };

  /// @param up Towards the sensor, for rays whose origin is not known. @param cell Side of a cell [m].
  RayGrid(const Cloud& cloud, const Eigen::Vector3d& up, double cell);
  /// One ray of each square of this side [m].
  RayGrid thinned(double side) const;

  const std::vector<Ray>& rays() const { return rays_; }
  const Eigen::Vector3d& mean_direction() const { return mean_; }
  /// Mean distance of neighbouring rays [m].
  double pitch() const { return pitch_; }
  /// Direction of the rays that pass by a point, from the ray nearest to it.
  Eigen::Vector3d direction_at(const Eigen::Vector3d& point) const;

  /// Calls `visit(ray)` for the rays that pass by `centre` within `radius`, and some more.
  template <class Visitor>
  void near(const Eigen::Vector3d& centre, double radius, Visitor&& visit) const {
    if (rays_.empty()) return;
    const Eigen::Vector2d at = crossing_of(centre, direction_at(centre)) - low_;
    const double reach = radius * 1.1;
    const int x0 = clamped((at.x() - reach) / cell_, columns_), x1 = clamped((at.x() + reach) / cell_, columns_);
    const int y0 = clamped((at.y() - reach) / cell_, rows_), y1 = clamped((at.y() + reach) / cell_, rows_);
    for (int y = y0; y <= y1; ++y) {
      const int begin = starts_[static_cast<std::size_t>(y * columns_ + x0)];
      const int end = starts_[static_cast<std::size_t>(y * columns_ + x1 + 1)];
      for (int i = begin; i < end; ++i) visit(rays_[static_cast<std::size_t>(i)]);
    }
  }

 private:
  RayGrid() = default;
  /// Sorts the rays into cells.
  void sort();
  static int clamped(double value, int count) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(count - 1)));
  }
  Eigen::Vector2d crossing_of(const Eigen::Vector3d& point, const Eigen::Vector3d& direction) const;

  std::vector<Ray> rays_;
  std::vector<int> starts_;  ///< Of the rays of each cell, and their number.
  Eigen::Vector3d mean_ = -Eigen::Vector3d::UnitZ();
  Eigen::Matrix<double, 3, 2> plane_ = Eigen::Matrix<double, 3, 2>::Identity();
  Eigen::Vector2d low_ = Eigen::Vector2d::Zero();
  double depth_ = 0.0, cell_ = 0.0, pitch_ = 0.0;
  int columns_ = 1, rows_ = 1;
};

}  // namespace kr5::picking
