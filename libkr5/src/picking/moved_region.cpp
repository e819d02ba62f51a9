// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/picking/moved_region.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <kr5/core/error.hpp>

#include "changed_pixels.hpp"

namespace kr5::picking {

using Eigen::Index;

namespace {

/// Whether a point, or one within `margin` [m] of it, shows a changed pixel; `outside` is called where it is not seen.
class ChangeLookup {
 public:
  ChangeLookup(const PixelMask& changed, const Pinhole& camera, const Pose& T_camera_base, double margin)
      : camera_(camera), T_camera_base_(T_camera_base), margin_(margin) {
    camera.validate();
    require(changed.rows() == camera.height && changed.cols() == camera.width,
            "changed: the mask must have as many rows and columns as the camera's image");
    require(T_camera_base.matrix().allFinite() && is_rotation(T_camera_base.linear()),
            "T_camera_base is no rigid motion");
    require(margin >= 0 && margin < 0.1, "margin must lie between 0 and 0.1 m [m]");
    distance_ = distance_to(changed);
  }

  enum class Seen { Outside, Unchanged, Changed };
  Seen at(const Eigen::Vector3d& p_base) const {
    const Eigen::Vector3d p = T_camera_base_ * p_base;
    if (!camera_.covers(p)) return Seen::Outside;
    const Eigen::Vector2d pixel = camera_.project(p);
    const double u = std::round(pixel.x()), v = std::round(pixel.y());
    if (!(u >= 0 && v >= 0 && u < camera_.width && v < camera_.height)) return Seen::Outside;
    const double reach = margin_ * std::max(camera_.fx, camera_.fy) / p.z();
    const bool changed = distance_(static_cast<Index>(v), static_cast<Index>(u)) <= std::max(reach, 0.5);
    return changed ? Seen::Changed : Seen::Unchanged;
  }

 private:
  const Pinhole& camera_;
  const Pose& T_camera_base_;
  double margin_;
  Eigen::MatrixXd distance_;
};

}  // namespace

PrunedCloud remove_changed(const Cloud& cloud, const PixelMask& changed, const Pinhole& camera,
                           const Pose& T_camera_base, double margin) {
  cloud.validate();
  const ChangeLookup lookup(changed, camera, T_camera_base, margin);
  PrunedCloud out;
  out.cloud = cloud;
  for (Index i = 0; i < cloud.points.cols(); ++i) {
    if (!cloud.points.col(i).allFinite()) continue;
    const auto seen = lookup.at(cloud.points.col(i));
    out.unseen += seen == ChangeLookup::Seen::Outside;
    if (seen != ChangeLookup::Seen::Changed) continue;
    ++out.removed;
    out.cloud.points.col(i).setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  return out;
}

std::vector<int> disturbed_pellets(const std::vector<Pellet>& pellets, const PixelMask& changed, const Pinhole& camera,
                                   const Pose& T_camera_base, double margin) {
  const ChangeLookup lookup(changed, camera, T_camera_base, margin);
  const Eigen::Vector3d eye = T_camera_base.inverse().translation();
  const auto shows = [&](const Eigen::Vector3d& p, const Eigen::Vector3d& normal) {
    return normal.dot(eye - p) > 0 && lookup.at(p) == ChangeLookup::Seen::Changed;
  };
  const auto disturbed = [&](const Pellet& pellet) {
    constexpr int around = 24, along = 7;
    for (int k = 0; k < around; ++k) {
      const double angle = 2 * std::numbers::pi * k / around;
      const Eigen::Vector3d out = pellet.frame * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
      for (int j = 0; j < along; ++j) {
        const double share = static_cast<double>(j) / (along - 1);
        const Eigen::Vector3d up = (share - 0.5) * pellet.height * pellet.frame.col(2);
        if (shows(pellet.centre + pellet.radius * out + up, out)) return true;
        for (const int end : {-1, 1}) {
          const Eigen::Vector3d face = 0.5 * end * pellet.height * pellet.frame.col(2);
          if (shows(pellet.centre + face + share * pellet.radius * out, end * pellet.frame.col(2))) return true;
        }
      }
    }
    return false;
  };
  std::vector<int> out;
  for (std::size_t i = 0; i < pellets.size(); ++i)
    if (disturbed(pellets[i])) out.push_back(static_cast<int>(i));
  return out;
}

}  // namespace kr5::picking
