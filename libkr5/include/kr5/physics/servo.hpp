// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/cell/cell.hpp>

/// @file
/// The servos of a cell with their effects: what joints and path corrections follow.

namespace kr5::physics {

/// Natural frequency of the servo of a joint [rad/s]. Needs joint servos.
double joint_servo(const cell::Cell& cell, int joint);
/// How late a joint servo gets its command [s]. Needs joint servos.
double joint_delay(const cell::Cell& cell, int joint);
/// Natural frequency of the servo of path corrections [rad/s]. Needs that servo, as the two below.
double tool_servo(const cell::Cell& cell);
/// Damping ratio of that servo [-].
double tool_damping(const cell::Cell& cell);
/// How late path corrections act [s].
double tool_delay(const cell::Cell& cell);

/// The joint servos, one a joint; none when the cell has no joint servo.
/// @throws InvalidArgument naming the field when a natural frequency is not positive.
std::vector<cell::SecondOrder> joint_servos(const cell::Cell& cell);
/// The servo of path corrections. Needs it.
cell::SecondOrder path_servo(const cell::Cell& cell);

}  // namespace kr5::physics
