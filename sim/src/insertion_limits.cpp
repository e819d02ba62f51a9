// SPDX-License-Identifier: BSD-3-Clause
#include "insertion_limits.hpp"

#include <kr5/core/error.hpp>
#include <kr5/robot/servo_feedforward.hpp>

namespace kr5::sim {
namespace {

constexpr double speed_part = 0.25;  // share of an absolute correction's change that is left for the motion itself

}  // namespace

void check_parts(const cell::Cell& cell) {
  cell.validate();
  require(cell.tool.has_value(), "tool: an insertion needs one");
  require(cell.contact.has_value(), "contact: an insertion needs one");
  require(cell.peg.has_value(), "peg: an insertion needs one");
  require(cell.tube.has_value(), "tube: an insertion needs one");
  require(cell.servo && !cell.servo->joint.empty(), "servo.joint: an insertion needs one");
  require(cell.servo->tool || !cell.servo->correction, "servo.tool: is missing, which servo.correction limits");
  require(!cell.robot.links.empty(), "robot.links: the arm needs masses");
}

/// In a cycle a command that is led ahead moves by the way of the speed, by what the lead grows with it, and, when the
/// acceleration is reversed, by two of it over the square of the frequency. An absolute correction may change by so
/// much; a relative one counts from where the arm is: there the whole lead must fit, and the way of the delay.
PathLimits path_limits(const cell::Cell& cell) {
  if (!cell.servo->correction || !cell.servo->correction->per_cycle) return {};
  const double limit = *cell.servo->correction->per_cycle, cycle = cell.servo->cycle;
  require(limit > 0, "servo.correction.per_cycle: must be positive [m]");
  const robot::ServoFeedforward lead(cell.servo->tool->natural_frequency, cell.servo->tool->damping_ratio);
  PathLimits out;
  if (cell.servo->correction->mode == cell::CorrectionMode::Absolute) {
    out.speed = speed_part * limit / cycle;
    out.acceleration = (1 - speed_part) * limit / (lead.of_speed * cycle + 2 * lead.of_acceleration);
  } else {
    out.speed = 0.5 * limit / (lead.of_speed + cell.servo->tool->delay + cycle);
    out.acceleration = 0.5 * limit / lead.of_acceleration;
  }
  return out;
}

}  // namespace kr5::sim
