// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>
#include <kr5/kinematics/body.hpp>

namespace kr5::physics {

/// Mass of what hangs on the tool beside it [kg].
double payload_mass(const cell::Cell& cell);
/// @throws InvalidArgument naming the effect, when that mass is negative.
void check_payload(const cell::Cell& cell);

/// Tool tip in the flange with tool_offset; camera and scanner ride on the nominal one. The flange itself without tool.
Pose tool_offset(const cell::Cell& cell);
/// All that hangs below the force sensor, tool and payload as one body in S. Needs a tool.
/// @throws InvalidArgument naming the effect, when its inertia is negative or has no mass.
kinematics::Body payload(const cell::Cell& cell);

/// Orientation of S in B when the tool points down, as the formats give steps, presses and profiles: its axes are X,
/// -Y, -Z of B. Row vectors in B times it are row vectors in S.
Eigen::Matrix3d R_base_sensor_down();
/// Wrench of that body on the sensor when the tool points down and rests. The same in each of `rows` rows, N x 6 [N, N
/// m].
Eigen::MatrixXd tool_weight(const cell::Cell& cell, Eigen::Index rows);

}  // namespace kr5::physics
