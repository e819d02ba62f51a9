// SPDX-License-Identifier: BSD-3-Clause
#include "pellet_grip.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <kr5/sim/cup_seat.hpp>

namespace kr5::sim {

using Eigen::Vector3d;

std::optional<PelletTaken> taken_by_cup(const Pose& T_tool_pellet, double radius, double height,
                                        const GripOptions& cup) {
  const CupSeat seat = cup_seat(T_tool_pellet, radius, height);
  if (!seat.sealed(cup)) return std::nullopt;
  return PelletTaken{seat.distance, T_tool_pellet};
}

std::optional<PelletTaken> taken_by_fingers(const Pose& T_tool_pellet, double radius, double height,
                                            const GripOptions& fingers, double length) {
  const Vector3d centre = T_tool_pellet.translation(), axis = T_tool_pellet.linear().col(2);
  const Vector3d in_plane(axis.x(), 0.0, axis.z());
  if (std::asin(std::min(std::abs(axis.y()), 1.0)) > fingers.angle) return std::nullopt;
  const double along = std::clamp(-centre.dot(axis), -0.5 * height, 0.5 * height);
  const Vector3d nearest = centre + along * axis;  // of the axis to E
  if (std::abs(nearest.y()) > fingers.reach || std::abs(nearest.x()) > radius || std::abs(nearest.z()) > length)
    return std::nullopt;
  PelletTaken out{nearest.norm(), T_tool_pellet};
  const Eigen::Matrix3d turn = Eigen::Quaterniond::FromTwoVectors(axis, in_plane).toRotationMatrix();
  out.T_tool_pellet.linear() = turn * T_tool_pellet.linear();
  out.T_tool_pellet.translation() = Vector3d(nearest.x(), 0.0, nearest.z()) - along * in_plane.normalized();
  return out;
}

Pose T_pellet_peg(const Pose& T_tool_pellet, double height) {
  const bool towards = T_tool_pellet.linear()(2, 2) <= 0.0;
  Pose out(Eigen::Translation3d(0, 0, towards ? -0.5 * height : 0.5 * height));
  if (!towards) out.rotate(Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitX()));
  return out;
}

}  // namespace kr5::sim
