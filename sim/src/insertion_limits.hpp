// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

#include <kr5/cell/cell.hpp>

/// @file
/// What an insertion asks of a cell, and what the limits of its path correction allow.

namespace kr5::sim {

constexpr double above = 0.015;  // height over the face at which a trial begins [m]
constexpr double lift = 0.03;    // way up from an inserted peg to the next one [m]

/// @throws InvalidArgument naming the part of the cell that is not there.
void check_parts(const cell::Cell& cell);

/// What the limits of the path correction leave of speed and acceleration, when commands are led ahead by the inverse
/// of its servo; without limits infinite. Of a cell that check_parts bears: limits come with the servo they limit.
struct PathLimits {
  double speed = std::numeric_limits<double>::infinity();         // [m/s]
  double acceleration = std::numeric_limits<double>::infinity();  // [m/s^2]
};
PathLimits path_limits(const cell::Cell& cell);

}  // namespace kr5::sim
