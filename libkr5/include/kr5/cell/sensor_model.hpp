// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>
#include <kr5/robot/sensing.hpp>

namespace kr5::cell {

/// What turns the sensors of a cell into readings of its robot: its nominal arm and tool, as a controller believes
/// them.
robot::SensorModel sensor_model(const Cell& cell);

}  // namespace kr5::cell
