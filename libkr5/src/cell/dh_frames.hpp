// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include <kr5/kinematics/dh_chain.hpp>

namespace kr5::cell {

/// A joint axis in the base, at zero. The x axis of the DH frame before the joint is taken on the side of `x`.
struct JointAxis {
  kinematics::JointType type = kinematics::JointType::Revolute;
  Eigen::Vector3d point, direction, x;
};

struct DhFrames {
  kinematics::DhChain chain;
  Pose T_flange_tip = Pose::Identity();  ///< A shift across the last axis, when no DH row can make it.
};

/// Rows whose frames have their z axes on the given ones, and at zero a flange with the axes of the tip.
DhFrames dh_frames(std::span<const JointAxis> axes, const Pose& T_base_tip);

}  // namespace kr5::cell
