// SPDX-License-Identifier: BSD-3-Clause
#include "vision/boards/find_charuco.hpp"

#include <algorithm>
#include <map>

#include <Eigen/LU>

#include "vision/boards/refine_point.hpp"
#include "vision/homography.hpp"

namespace kr5::vision {
namespace {

using Eigen::Vector2d;

/// Homography board -> image from the corners of some markers.
std::optional<Eigen::Matrix3d> local_homography(const std::vector<const TagDetection*>& tags,
                                                const std::vector<Eigen::Matrix<double, 3, 4>>& corners) {
  Eigen::Matrix2Xd board(2, 4 * tags.size()), image(2, 4 * tags.size());
  for (std::size_t i = 0; i < tags.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(4 * i);
    board.middleCols<4>(at) = corners[i].topRows<2>();
    image.middleCols<4>(at) = tags[i]->corners;
  }
  return fit_homography(board, image);
}

}  // namespace

std::optional<SeenPoints> find_charuco(ImageView image, const Target& target, const std::vector<TagDetection>& tags,
                                       Refinement refine) {
  const std::vector<MapMarker> markers = target_markers(target);
  const TargetPoints points = target_points(target);
  SeenPoints seen;
  for (std::size_t i = 0; i < points.ids.size(); ++i) {
    const Eigen::Vector3d p = points.points.col(static_cast<Eigen::Index>(i));
    std::vector<const TagDetection*> near;
    std::vector<Eigen::Matrix<double, 3, 4>> places;
    for (const TagDetection& tag : tags) {
      const MapMarker& m = markers[static_cast<std::size_t>(tag.id - target.first_id)];
      if ((m.T_target_marker.translation() - p).cwiseAbs().maxCoeff() > target.size) continue;
      near.push_back(&tag);
      places.push_back(m.T_target_marker * square_corners(m.size));
    }
    if (near.empty()) continue;
    const auto H = local_homography(near, places);
    if (!H) continue;
    const auto project = [&](double x, double y) -> Vector2d { return (*H * Eigen::Vector3d(x, y, 1)).hnormalized(); };
    const Vector2d pixel = project(p.x(), p.y());
    const Vector2d dx = project(p.x() + target.size / 2, p.y()) - project(p.x() - target.size / 2, p.y());
    const Vector2d dy = project(p.x(), p.y() + target.size / 2) - project(p.x(), p.y() - target.size / 2);
    if (refine == Refinement::None) {
      seen.add(points.ids[i], pixel, 0.0);
      continue;
    }
    const double scale = std::min(dx.norm(), dy.norm());
    const double clear = 0.85 * M_SQRT1_2 * (1 - target.marker / target.size) * scale;  // to the marker's corner
    const auto better = refine_saddle(image, pixel, dx, dy, std::clamp(std::min(clear, 0.45 * scale), 2.5, 12.0));
    if (better) seen.add(points.ids[i], better->pixel, better->sigma);
  }
  if (seen.index.empty()) return std::nullopt;
  return seen;
}

}  // namespace kr5::vision
