// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>
#include <kr5/robot/servo_feedforward.hpp>

namespace kr5::work {

/// By how much commands must be ahead of the path, for the servo of a cell's path correction; none: it follows at once.
inline robot::ServoFeedforward servo_lead(const cell::Cell& believed) {
  if (!believed.servo || !believed.servo->tool) return {0.0, 1.0};
  return {believed.servo->tool->natural_frequency, believed.servo->tool->damping_ratio};
}

}  // namespace kr5::work
