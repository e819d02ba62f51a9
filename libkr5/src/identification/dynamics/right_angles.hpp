// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/kinematics/dh_chain.hpp>

/// @file
/// Which masses an arm tells must not depend on the last digits of its angles.

namespace kr5::identification {

/// A chain with the gravity in its base [m/s^2].
struct ArmInGravity {
  kinematics::DhChain chain;
  Eigen::Vector3d gravity;
};

/// The arm as it is meant: axes that are parallel, across or along gravity but for rounding of its angles are so
/// exactly, and lengths below 1e-4 of its reach are none. Descriptions round right angles (1.5708, 1.57): a tilt of
/// that size would make mass moments of the ground count as determined, with values that noise alone decides. Its base
/// is frame 0.
ArmInGravity with_right_angles(const kinematics::DhChain& chain, const Eigen::Vector3d& gravity);

}  // namespace kr5::identification
