// SPDX-License-Identifier: BSD-3-Clause
#include "ray_grid.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <unordered_set>

#include <kr5/core/statistics.hpp>

#include "axes.hpp"

namespace kr5::picking {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::Vector3d;

RayGrid::RayGrid(const Cloud& cloud, const Vector3d& up, double cell) : cell_(cell) {
  Vector3d sum = Vector3d::Zero();
  std::vector<double> depths;
  for (Index i = 0; i < cloud.points.cols(); ++i) {
    const Vector3d p = cloud.points.col(i);
    if (!p.allFinite()) continue;
    Vector3d d = -up;
    if (cloud.origins.cols() > 0) d = p - cloud.origins.col(cloud.origins.cols() > 1 ? i : 0);
    d.normalize();
    sum += d;
    rays_.push_back({p, d, Vector2d::Zero(), static_cast<int>(i)});
  }
  if (rays_.empty()) {
    starts_ = {0, 0};
    return;
  }
  mean_ = sum.normalized();
  plane_ = axes_about(mean_).leftCols<2>();
  for (const Ray& ray : rays_) depths.push_back(ray.point.dot(mean_));
  depth_ = median(std::move(depths));
  for (Ray& ray : rays_) ray.crossing = crossing_of(ray.point, ray.direction);
  sort();
}

void RayGrid::sort() {
  Vector2d high = Vector2d::Constant(-std::numeric_limits<double>::infinity());
  low_ = -high;
  for (const Ray& ray : rays_) {
    low_ = low_.cwiseMin(ray.crossing);
    high = high.cwiseMax(ray.crossing);
  }
  const auto count = static_cast<double>(rays_.size());
  const Vector2d extent = high - low_;
  cell_ = std::max(cell_, std::sqrt(extent.x() * extent.y() / (4 * count)));  // at most four cells a ray
  columns_ = static_cast<int>(extent.x() / cell_) + 1;
  rows_ = static_cast<int>(extent.y() / cell_) + 1;
  starts_.assign(static_cast<std::size_t>(columns_ * rows_ + 1), 0);
  std::vector<int> place(rays_.size());
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    const Vector2d at = (rays_[i].crossing - low_) / cell_;
    place[i] = clamped(at.y(), rows_) * columns_ + clamped(at.x(), columns_);
    ++starts_[static_cast<std::size_t>(place[i] + 1)];
  }
  int occupied = 0;
  for (const int number : starts_) occupied += number > 0;
  pitch_ = std::sqrt(occupied * cell_ * cell_ / count);
  std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
  std::vector<Ray> sorted(rays_.size());
  std::vector<int> next = starts_;
  for (std::size_t i = 0; i < rays_.size(); ++i)
    sorted[static_cast<std::size_t>(next[static_cast<std::size_t>(place[i])]++)] = rays_[i];
  rays_ = std::move(sorted);
}

RayGrid RayGrid::thinned(double side) const {
  RayGrid out = *this;
  std::unordered_set<std::int64_t> squares;
  std::erase_if(out.rays_, [&](const Ray& ray) {
    const Vector2d at = ((ray.crossing - low_) / side).array().floor();
    return !squares.insert(static_cast<std::int64_t>(at.x()) << 32 | static_cast<std::int64_t>(at.y())).second;
  });
  if (!out.rays_.empty()) out.sort();
  return out;
}

Vector2d RayGrid::crossing_of(const Vector3d& point, const Vector3d& direction) const {
  const double along = (depth_ - point.dot(mean_)) / std::max(direction.dot(mean_), 0.1);
  return plane_.transpose() * (point + along * direction);
}

Vector3d RayGrid::direction_at(const Vector3d& point) const {
  Vector3d direction = mean_;
  if (rays_.empty()) return direction;
  for (int round = 0; round < 2; ++round) {
    const Vector2d at = crossing_of(point, direction) - low_;
    const int x = clamped(at.x() / cell_, columns_), y = clamped(at.y() / cell_, rows_);
    for (int reach = 0; reach < 4; ++reach) {  // the first ring of cells that has a ray
      const Ray* found = nullptr;
      for (int v = std::max(0, y - reach); v <= std::min(rows_ - 1, y + reach) && !found; ++v) {
        const int begin = starts_[static_cast<std::size_t>(v * columns_ + std::max(0, x - reach))];
        const int end = starts_[static_cast<std::size_t>(v * columns_ + std::min(columns_ - 1, x + reach) + 1)];
        if (begin < end) found = &rays_[static_cast<std::size_t>((begin + end) / 2)];
      }
      if (found) {
        direction = found->direction;
        break;
      }
    }
  }
  return direction;
}

}  // namespace kr5::picking
