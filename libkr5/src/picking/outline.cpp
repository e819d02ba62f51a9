// SPDX-License-Identifier: BSD-3-Clause
#include "outline.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kr5::picking {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

/// Where the eye is about the axis, and half the angle of the side that it sees; 0 where it looks along the axis.
struct SideView {
  double middle = 0.0, half = 0.0;
};
SideView side_view(const SolidCylinder& cylinder, const Vector3d& eye) {
  const double across = eye.head<2>().norm();
  return {std::atan2(eye.y(), eye.x()), across > cylinder.radius ? std::acos(cylinder.radius / across) : 0.0};
}

Vector3d local_eye(const OutlineView& view) { return view.cylinder.local(view.T_camera_base.inverse().translation()); }

bool is_line(OutlinePart part) { return part == OutlinePart::Left || part == OutlinePart::Right; }

double angle_of(const OutlineView& view, const OutlinePoint& point) {
  if (!is_line(point.part)) return point.angle;
  const SideView side = side_view(view.cylinder, local_eye(view));
  return side.middle + (point.part == OutlinePart::Left ? side.half : -side.half);
}

Vector3d local_place(const SolidCylinder& c, double angle, double end) {
  return {c.radius * std::cos(angle), c.radius * std::sin(angle), end * c.height / 2};
}

/// Adds places along a curve of local points, once every `spacing` pixels.
class OutlineWalk {
 public:
  OutlineWalk(const OutlineView& view, const Pinhole& camera, double spacing, std::vector<OutlinePoint>& out)
      : view_(view), camera_(camera), spacing_(spacing), out_(out) {}

  /// `at(t)`: the place for t in [0, 1].
  template <class Curve>
  void along(const Curve& at) {
    constexpr int steps = 400;
    std::vector<Vector2d> pixels;
    for (int k = 0; k <= steps; ++k) {
      const Vector3d p = view_.T_camera_base * outline_place(view_, at(k / double{steps}));
      if (!camera_.covers(p)) return;
      pixels.push_back(camera_.project(p));
    }
    double since = 0.5 * spacing_;
    for (int k = 1; k < steps; ++k) {
      since += (pixels[k] - pixels[k - 1]).norm();
      if (since < spacing_) continue;
      since = 0;
      const Vector2d along = pixels[k + 1] - pixels[k - 1];
      OutlinePoint point = at(k / double{steps});
      point.pixel = pixels[k];
      point.normal = Vector2d(-along.y(), along.x()).normalized();
      if (point.normal.allFinite()) out_.push_back(point);
    }
  }
  void arc(OutlinePart part, double end, double from, double to) {
    along([=](double t) { return OutlinePoint{.part = part, .end = end, .angle = from + t * (to - from)}; });
  }

 private:
  const OutlineView& view_;
  const Pinhole& camera_;
  double spacing_;
  std::vector<OutlinePoint>& out_;
};

}  // namespace

OutlineView OutlineView::moved(const Eigen::Matrix<double, outline_steps, 1>& step) const {
  OutlineView out = *this;
  out.cylinder.centre += cylinder.frame * step.head<3>();
  out.cylinder.frame = cylinder.frame * exp_rotation({step[3], step[4], 0});
  out.cylinder.radius = std::max(cylinder.radius + step[5], 0.2 * cylinder.radius);
  out.cylinder.height = std::max(cylinder.height + step[6], 0.2 * cylinder.height);
  out.T_camera_base = T_camera_base * to_pose(step.tail<6>());
  return out;
}

std::vector<OutlinePoint> outline(const OutlineView& view, const Pinhole& camera, double spacing) {
  const Vector3d eye = local_eye(view);
  const SideView side = side_view(view.cylinder, eye);
  std::vector<OutlinePoint> all;
  OutlineWalk walk(view, camera, spacing, all);
  if (side.half > 0)
    for (const OutlinePart part : {OutlinePart::Left, OutlinePart::Right})
      walk.along([part](double t) { return OutlinePoint{.part = part, .end = 2 * t - 1}; });
  for (const int end : {1, -1}) {
    const double low = side.middle - side.half, high = side.middle + side.half;
    if (end * eye.z() > view.cylinder.height / 2) {
      if (side.half > 0) walk.arc(OutlinePart::Near, end, low, high);
      walk.arc(OutlinePart::Far, end, high, low + 2 * std::numbers::pi);
    } else if (side.half > 0) {
      const bool neither = std::abs(eye.z()) <= view.cylinder.height / 2;
      walk.arc(neither && end < 0 ? OutlinePart::AwayToo : OutlinePart::Away, end, low, high);
    }
  }
  std::vector<OutlinePoint> out;
  for (const OutlinePoint& a : all) {
    const bool lonely = std::none_of(all.begin(), all.end(), [&](const OutlinePoint& b) {
      return b.part != a.part && (a.pixel - b.pixel).squaredNorm() < spacing * spacing;
    });
    if (lonely) out.push_back(a);
  }
  return out;
}

Vector3d outline_place(const OutlineView& view, const OutlinePoint& point) {
  return view.cylinder.centre + view.cylinder.frame * local_place(view.cylinder, angle_of(view, point), point.end);
}

double outline_offset(const OutlineView& view, const Pinhole& camera, const OutlinePoint& point, OutlineRow* by_steps) {
  const SolidCylinder& c = view.cylinder;
  const double angle = angle_of(view, point);
  const Vector3d q = local_place(c, angle, point.end), p_base = c.centre + c.frame * q;
  Eigen::Matrix<double, 2, 3> by_point;
  const Vector2d pixel = camera.project(view.T_camera_base * p_base, &by_point, nullptr);
  if (by_steps != nullptr) {
    const Eigen::RowVector3d by_base = point.normal.transpose() * by_point * view.T_camera_base.linear();
    Eigen::Matrix<double, 3, 7> local;
    local.leftCols<3>().setIdentity();
    local.col(3) = Vector3d::UnitX().cross(q);
    local.col(4) = Vector3d::UnitY().cross(q);
    local.col(5) = Vector3d(std::cos(angle), std::sin(angle), 0);
    local.col(6) = Vector3d(0, 0, point.end / 2);
    by_steps->head<7>() = by_base * c.frame * local;
    by_steps->segment<3>(7) = by_base;
    by_steps->tail<3>() = -by_base * skew(p_base);
  }
  return point.normal.dot(pixel - point.pixel);
}

}  // namespace kr5::picking
