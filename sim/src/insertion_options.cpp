// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/insertion_options.hpp>

#include <algorithm>
#include <iomanip>
#include <sstream>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/robot/cycle.hpp>

#include "insertion_arm.hpp"
#include "insertion_limits.hpp"

namespace kr5::sim {
namespace {

constexpr double turn_back = 0.3;  // in which a speed along the contact can be taken back [s]
constexpr double slowest = 2e-4;   // with which a peg still feels its way in minutes [m/s]

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
              " m, and an insertion moves " + text(way) + " m along one axis; raise the limit, or leave it out");
}

/// An arm whose corrections are limited is moved within what they can: forces are held by reversing speeds, and a turn
/// takes as much longer as the peg is slower to follow the edge.
void slow_down(force::InsertionOptions& options, const cell::Cell& cell) {
  const PathLimits most = path_limits(cell);
  force::InsertionMotion& m = options.motion;
  m.acceleration = std::min(m.acceleration, most.acceleration);
  m.braking = std::min(m.braking, most.acceleration);
  m.approach_speed = std::min(m.approach_speed, most.speed);
  m.push_speed = std::min(m.push_speed, most.speed);
  const double before = m.contact_speed;
  for (double* speed : {&m.contact_speed, &m.slide_speed})
    *speed = std::min({*speed, most.speed, turn_back * most.acceleration});
  if (m.contact_speed < slowest) {
    const double limit = *cell.servo->correction->per_cycle;
    throw InvalidArgument("servo.correction.per_cycle: " + text(limit) + " m limits the contact speed to " +
                          text(m.contact_speed) + " m/s; an insertion needs a limit of at least " +
                          text(limit * slowest / m.contact_speed) + " m");
  }
  const double slower = before / m.contact_speed;
  m.roll_time *= slower;
  options.limits.time *= slower;
}

/// Hayat et al. 2022, algorithm of section 5.6.
void set_hayat2022(force::InsertionOptions& out) {
  out.localisation = force::Localisation::Cusp;
  out.entry = force::EntryAttitude::Upright;
  out.grip.corrected = false;
  out.motion.slide_speed = 0.03e-3 / robot::usual_cycle;  // 0.03 mm a cycle of theirs
  out.motion.roll_time = 24.0;  // not printed: with it the first attempt succeeds as often as theirs did, 70 %
}

}  // namespace

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
  for (const cell::SecondOrder& joint : cell.servo->joint)
    out.limits.halting = std::max(out.limits.halting, joint.delay + 2 * joint.damping_ratio / joint.natural_frequency);
  out.insert_by = setup.insert_by;
  out.grip = believed_grip(cell, setup);
  out.motion.depth = std::min(0.6 * cell.peg->length, 0.8 * cell.tube->depth);
  check_range(cell, setup, out.motion.depth);
  if (!setup.noise) out.limits.dead_after = 0.0;  // a sensor without noise may well say the same
  if (setup.strategy == Strategy::Hayat2022) set_hayat2022(out);
  slow_down(out, cell);
  return out;
}

}  // namespace kr5::sim
