// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/insertion.hpp>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>
#include <string>

#include <kr5/core/error.hpp>

#include "insertion_arm.hpp"
#include "insertion_task.hpp"

namespace kr5::sim {
namespace {

constexpr double turn_back = 0.3;    // in which a speed along the contact can be taken back [s]
constexpr double slowest = 2e-4;     // with which a peg still feels its way in minutes [m/s]
constexpr double speed_part = 0.25;  // of an absolute correction's change, for the way of a cycle

std::string text(double value) {
  std::ostringstream out;
  out << std::setprecision(3) << value;
  return out.str();
}

/// The longest way along one axis must lie within the range of the corrections.
void check_range(const cell::Cell& cell, const InsertionSetup& setup, double depth) {
  if (!cell.servo->correction || !cell.servo->correction->total) return;
  double way = above + depth;
  if (setup.pegs > 1) way = std::max({way, setup.pick_distance, lift});
  require(*cell.servo->correction->total >= way,
          "servo.correction.total: the arm may be corrected by " + text(*cell.servo->correction->total) +
              " m, and an insertion goes " + text(way) + " m along one axis: raise it, or leave it out");
}

/// An arm whose corrections are limited is moved within what they can: forces are held by reversing speeds, and a turn
/// takes as much longer as the peg is slower to follow the edge.
void slow_down(force::InsertionOptions& options, const cell::Cell& cell) {
  const PathLimits most = path_limits(cell);
  force::InsertionMotion& m = options.motion;
  m.acceleration = std::min(m.acceleration, most.acceleration);
  m.approach_speed = std::min(m.approach_speed, most.speed);
  m.push_speed = std::min(m.push_speed, most.speed);
  const double before = m.contact_speed;
  for (double* speed : {&m.contact_speed, &m.slide_speed})
    *speed = std::min({*speed, most.speed, turn_back * most.acceleration});
  if (m.contact_speed < slowest) {
    const double limit = *cell.servo->correction->per_cycle;
    throw InvalidArgument("servo.correction.per_cycle: " + text(limit) + " m lets a peg feel at no more than " +
                          text(m.contact_speed) + " m/s; an insertion needs " +
                          text(limit * slowest / m.contact_speed) + " m at least");
  }
  const double slower = before / m.contact_speed;
  m.roll_time *= slower;
  options.limits.time *= slower;
}

/// Hayat et al. 2022, algorithm of section 5.6.
void as_in_the_book(force::InsertionOptions& out) {
  out.localisation = force::Localisation::Cusp;
  out.entry = force::Entry::Upright;
  out.grip.corrected = false;
  out.motion.slide_speed = 0.03e-3 / 0.012;  // 0.03 mm a cycle
  out.motion.roll_time = 24.0;  // not printed: with it the first attempt succeeds as often as theirs did, 70 %
}

}  // namespace

void check_parts(const cell::Cell& cell) {
  cell.validate();
  require(cell.tool.has_value(), "tool: an insertion needs one");
  require(cell.contact.has_value(), "contact: an insertion needs one");
  require(cell.peg.has_value(), "peg: an insertion needs one");
  require(cell.tube.has_value(), "tube: an insertion needs one");
  require(cell.servo && !cell.servo->joint.empty(), "servo.joint: an insertion needs one");
  require(cell.servo->tool || !cell.servo->correction, "servo.correction: what it limits is missing: servo.tool");
  require(!cell.robot.links.empty(), "robot.links: the arm needs masses");
}

/// In a cycle a command that is led ahead moves by the way of the speed, by what the lead grows with it, and, when the
/// acceleration is reversed, by two of it over the square of the frequency. An absolute correction may change by so
/// much; a relative one counts from where the arm is: there the whole lead must fit, and the way of the delay.
PathLimits path_limits(const cell::Cell& cell) {
  if (!cell.servo->correction || !cell.servo->correction->per_cycle) return {};
  const double limit = *cell.servo->correction->per_cycle, cycle = cell.servo->cycle;
  require(limit > 0, "servo.correction.per_cycle: must be positive [m]");
  const double w = cell.servo->tool->natural_frequency, lead = 2 * cell.servo->tool->damping_ratio / w;
  PathLimits out;
  if (cell.servo->correction->mode == cell::CorrectionMode::Absolute) {
    out.speed = speed_part * limit / cycle;
    out.acceleration = (1 - speed_part) * limit / (lead * cycle + 2 / (w * w));
  } else {
    out.speed = 0.5 * limit / (lead + cell.servo->tool->delay + cycle);
    out.acceleration = 0.5 * limit * w * w;
  }
  return out;
}

void InsertionSetup::validate() const {
  require(std::isfinite(clearance), "clearance: must be finite [m]");
  require(tilt > 0 && tilt < M_PI_2, "tilt: must lie between 0 and a quarter turn [rad]");
  require(offset.allFinite(), "offset: must be finite [m]");
  require(pegs >= 1, "pegs: must be at least 1");
  for (const auto& [value, name] : {std::pair{pick_distance, "pick_distance"},
                                    {repeatability, "repeatability"},
                                    {grip_error, "grip_error"},
                                    {grip_tilt, "grip_tilt"},
                                    {tube_tilt, "tube_tilt"},
                                    {face_error, "face_error"},
                                    {stiffness_error, "stiffness_error"},
                                    {servo_error, "servo_error"},
                                    {friction_error, "friction_error"},
                                    {lateral_stiffness, "lateral_stiffness"}})
    require(value >= 0 && std::isfinite(value), std::string(name) + ": must not be negative");
  require(angular_stiffness > 0 && std::isfinite(angular_stiffness), "angular_stiffness: must be positive [N m/rad]");
}

force::GripModel believed_grip(const cell::Cell& cell, const InsertionSetup& setup) {
  const double height = 0.8 * cell.peg->length;
  return {.axial = cell.contact->stiffness,
          .lateral = setup.lateral_stiffness > 0 ? setup.lateral_stiffness : cell.contact->stiffness,
          .angular = setup.angular_stiffness,
          .height = height,
          .tilt_uncertainty = setup.noise ? std::hypot(setup.grip_tilt, setup.tube_tilt) : 0.0,
          .position_uncertainty =
              setup.noise ? std::hypot(setup.grip_error, setup.repeatability / 3, height * setup.grip_tilt) : 0.0};
}

force::InsertionOptions insertion_options(const cell::Cell& cell, const InsertionSetup& setup) {
  setup.validate();
  check_parts(cell);
  force::InsertionOptions out;
  const double bore = cell.peg->radius + setup.clearance;
  out.bodies = {cell.peg->radius, bore, cell.tube->outer_radius + bore - cell.tube->inner_radius};
  out.tilt = setup.tilt;
  out.cycle = cell.servo->cycle;
  out.delay = cell.servo->tool ? cell.servo->tool->delay : cell.servo->joint.front().delay;
  if (cell.servo->tool) {
    out.servo_frequency = cell.servo->tool->natural_frequency;
    out.servo_damping = cell.servo->tool->damping_ratio;
  }
  out.insert_by = setup.insert_by;
  out.grip = believed_grip(cell, setup);
  out.motion.depth = std::min(0.6 * cell.peg->length, 0.8 * cell.tube->depth);
  check_range(cell, setup, out.motion.depth);
  if (!setup.noise) out.limits.dead_after = 0.0;  // a sensor without noise may well say the same
  if (setup.strategy == Strategy::Hayat2022) as_in_the_book(out);
  slow_down(out, cell);
  return out;
}

}  // namespace kr5::sim
