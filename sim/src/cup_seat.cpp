// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/cup_seat.hpp>

#include <algorithm>
#include <cmath>

#include "cylinder_contact.hpp"

namespace kr5::sim {

CupSeat cup_seat(const Pose& T_tool_pellet, double radius, double height) {
  Eigen::Vector3d normal;
  CupSeat out;
  out.distance = std::abs(cylinder_distance(T_tool_pellet.inverse().translation(), radius, 0.5 * height, normal));
  out.angle = std::acos(std::clamp(-(T_tool_pellet.linear() * normal).z(), -1.0, 1.0));
  return out;
}

CupSeat nearest_cup_seat(const PelletScene& scene, const Pose& T_bin_tool) {
  const Pose T_tool_bin = T_bin_tool.inverse();
  CupSeat best;
  for (int i = 0; i < static_cast<int>(scene.pellets.size()); ++i) {
    const Pellet& p = scene.pellets[static_cast<std::size_t>(i)];
    CupSeat seat = cup_seat(T_tool_bin * p.T_bin_pellet, p.radius, p.height);
    if (!(seat.distance < best.distance)) continue;
    best = seat;
    best.pellet = i;
  }
  return best;
}

}  // namespace kr5::sim
