// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/picking/clearance.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <kr5/core/error.hpp>

#include "axes.hpp"
#include "convex_distance.hpp"

namespace kr5::picking {

using Eigen::Vector3d;

double cylinder_box_distance(const Pose& T_base_cylinder, double radius, double height, const Pose& T_base_box,
                             const Vector3d& half) {
  require(radius > 0 && height > 0, "radius and height must be positive [m]");
  require(half.minCoeff() > 0, "half must be three positive numbers [m]");
  const Pose T_box_cylinder = T_base_box.inverse() * T_base_cylinder;
  const Eigen::Matrix3d& R = T_box_cylinder.linear();
  const auto support = [&](const Vector3d& d) -> Vector3d {
    const Vector3d local = R.transpose() * d;
    const double across = local.head<2>().norm();
    Vector3d on_cylinder(0, 0, local.z() >= 0 ? height / 2 : -height / 2);
    if (across > 1e-300) on_cylinder.head<2>() = radius / across * local.head<2>();
    const Vector3d on_box = (d.array() > 0).select(-half, half);  // furthest against d
    return T_box_cylinder * on_cylinder - on_box;
  };
  return convex_distance(support).lower;
}

double gripper_clearance(const GripperPose& gripper, const std::vector<GripperPart>& parts, const Bin& bin,
                         bool with_floor) {
  bin.validate();
  require(!parts.empty(), "parts: none");
  require(gripper.tip.allFinite() && std::abs(gripper.outwards.norm() - 1) < 1e-6,
          "outwards must be a direction of length 1");
  const double t = std::max(bin.wall_thickness, 1e-4);  // a wall without thickness is a thin one
  const Vector3d& s = bin.size;
  struct Plate {
    Vector3d centre, half;
  };
  const Vector3d wall_x(t / 2, s.y() / 2 + t, s.z() / 2 + t / 2), wall_y(s.x() / 2 + t, t / 2, s.z() / 2 + t / 2);
  const double middle = s.z() / 2 - t / 2;
  const std::array<Plate, 5> plates{
      Plate{{s.x() / 2 + t / 2, 0, middle}, wall_x}, Plate{{-s.x() / 2 - t / 2, 0, middle}, wall_x},
      Plate{{0, s.y() / 2 + t / 2, middle}, wall_y}, Plate{{0, -s.y() / 2 - t / 2, middle}, wall_y},
      Plate{{0, 0, -t / 2}, {s.x() / 2, s.y() / 2, t / 2}}};
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const GripperPart& part = parts[i];
    require(part.radius > 0 && part.end > part.start && std::isfinite(part.end + part.start),
            "parts: row " + std::to_string(i) + ": radius must be positive and end above start [m]");
    Pose T_base_part = Pose::Identity();
    T_base_part.linear() = axes_about(gripper.outwards);
    T_base_part.translation() = gripper.tip + gripper.outwards * ((part.start + part.end) / 2);
    for (std::size_t k = 0; k < (with_floor ? 5U : 4U); ++k) {
      const Pose T_base_plate = bin.T_base_bin * Eigen::Translation3d(plates[k].centre);
      least = std::min(
          least, cylinder_box_distance(T_base_part, part.radius, part.end - part.start, T_base_plate, plates[k].half));
    }
  }
  return least;
}

BookClearance book_clearance(const GripperPose& gripper, double radius, const Bin& bin) {
  bin.validate();
  require(radius > 0 && std::isfinite(radius), "radius must be positive [m]");
  const Vector3d p = bin.T_base_bin.inverse() * gripper.tip;
  const Vector3d n = bin.T_base_bin.linear().transpose() * gripper.outwards;
  const double alpha = std::atan2(std::hypot(n.x(), n.y()), n.z());
  const double h = bin.size.z() - p.z();
  double g = std::numeric_limits<double>::infinity();  // along the lean, to the nearer wall line of its quadrant
  const double lean = std::hypot(n.x(), n.y());
  for (int k = 0; k < 2; ++k) {
    const double wall = bin.size[k] / 2, to_wall = n[k] >= 0 ? wall - p[k] : wall + p[k];
    if (std::abs(n[k]) > 1e-12 * lean && lean > 0) g = std::min(g, to_wall * lean / std::abs(n[k]));
    if (lean == 0) g = std::min({g, wall - p[k], wall + p[k]});
  }
  const double reach = std::hypot(h, g);
  BookClearance out;
  out.gamma = (radius < reach ? std::asin(radius / reach) : std::numbers::pi / 2) + alpha;
  out.beta = std::atan2(g, h);
  out.clears = h <= 0 || out.gamma < out.beta;
  return out;
}

}  // namespace kr5::picking
