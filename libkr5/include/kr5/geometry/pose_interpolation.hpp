// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/geometry/pose.hpp>

namespace kr5 {

/// Pose at a share of the way from a (0) to b (1), or beyond: the position moves straight, the orientation along the
/// shortest turn.
inline Pose interpolate_pose(const Pose& a, const Pose& b, double share) {
  Pose out = Pose::Identity();
  out.translation() = (1 - share) * a.translation() + share * b.translation();
  out.linear() = a.linear() * exp_rotation(share * log_rotation(a.linear().transpose() * b.linear()));
  return out;
}

}  // namespace kr5
