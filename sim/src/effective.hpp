// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/force/peg_tube_contact.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/kinematics/body.hpp>

/// @file
/// What a cell is once the effects on its geometry and masses are put in.

namespace kr5::sim {

/// DH rows with link_length, link_twist and thermal_growth at time t [s].
std::vector<kinematics::DhJoint> effective_joints(const cell::Cell& cell, double t);
/// T_B_0 of the robot as it stands.
Pose effective_base(const cell::Cell& cell);
/// Peg and tube, with tube_radius. Needs both.
force::PegTubeShape real_shape(const cell::Cell& cell);
/// Tool and payload (a point) as one body, in S.
kinematics::Body effective_tool(const cell::Cell& cell);

}  // namespace kr5::sim
