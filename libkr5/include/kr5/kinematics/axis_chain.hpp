// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/kinematics/dh_chain.hpp>

/// @file
/// Denavit-Hartenberg parameters of an arm whose joint axes are known as lines (Hayat et al. 2022, sections 4.2.2 and
/// B.3).

namespace kr5::kinematics {

/// A joint axis as a line: it turns counter-clockwise about `direction` as the joint value grows.
struct AxisLine {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();       ///< [m]
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< Unit vector.

  static void each_field(auto& self, auto&& visit) {
    visit("point", self.point, "A point of the axis [m].");
    visit("direction", self.direction, "Direction, of unit length.");
  }
};

/// Sine of the angle between neighbouring axes below which they are taken as near-parallel [-].
inline constexpr double near_parallel_sine = 0.1;

/// The chain of revolute joints whose axes lie so in the base when the joint values are q.
///
/// Link lengths and twists are the dual angles of neighbouring axes, offsets and joint angles those of neighbouring
/// common normals. Axes closer to parallel than `parallel` get Hayati's beta and the common normal through the foot of
/// the previous one, so that b is 0 there. The frame of the first joint has its origin in the point of the first axis
/// that is nearest to the origin of the base; its x axis is the base's, projected.
/// @param T_base_flange Pose of the flange at q: the end of the last link. A row cannot tell its place along its own z
///                      axis, nor its turn about it: those belong to the tool.
/// @throws InvalidArgument for no axis, a direction that is no unit vector, or sizes that differ.
DhChain chain_from_axes(std::span<const AxisLine> axes, const Eigen::VectorXd& q, const Pose& T_base_flange,
                        double parallel = near_parallel_sine);

/// Whether the axes before and behind a link are near-parallel, as chain_from_axes takes it: beta is then one of its
/// parameters, and b is 0 by choice.
bool has_near_parallel_axes(const DhJoint& joint, double parallel = near_parallel_sine);

/// The axes of a chain of revolute joints at joint values q, in the base.
std::vector<AxisLine> axes_of(const DhChain& chain, const Eigen::VectorXd& q);

}  // namespace kr5::kinematics
