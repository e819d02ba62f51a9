// SPDX-License-Identifier: BSD-3-Clause
#include "force/insertion/machine.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kr5::force {
namespace {

constexpr int search_iterations = 40;
constexpr double most_part = 0.8;      // of the limit of force, that a contact may come to
constexpr double doubtful_part = 0.3;  // of the believed stiffness, as a standard deviation

/// From a force to the arm's answer to it [s].
double loop_delay(const InsertionOptions& o) {
  return o.delay + WrenchLowPass(o.cutoff, o.cycle).delay() + 2 * o.cycle;
}

bool stable(const InsertionOptions& o) {
  const InsertionForces& f = o.forces;
  const double delay = loop_delay(o);
  const ComplianceOptions across{f.lateral_gain, f.angular_gain, 1.0, 1.0}, along{f.axial_gain, 0.0, 1.0, 1.0};
  return across.stable(o.grip.lateral, o.grip.angular, delay) && along.stable(o.grip.axial, 0.0, delay);
}

/// What is not known of what gives way along the peg, where it is counted in at all [m/N].
double compliance_uncertainty(const InsertionOptions& o) {
  return o.grip.corrected ? doubtful_part / o.grip.axial : 0.0;
}

const InsertionOptions& validated(const InsertionOptions& o) {
  o.validate();
  return o;
}

}  // namespace

SafetyLimits safety_limits(const InsertionOptions& o) {
  return {o.limits.force, o.limits.torque, o.limits.current, o.limits.dead_after, o.cycle};
}

double guarded_speed(const InsertionOptions& o) {
  const double room = std::max(most_part * o.limits.force - o.forces.obstacle, 0.0) / o.grip.axial;
  const double safe = room / (o.limits.halting + 2 * o.cycle);  // until a reading has its answer
  return std::min(o.motion.approach_speed, std::max(safe, o.motion.contact_speed));
}

double guarded_push_speed(const InsertionOptions& o) {
  GuardedMoveOptions push = guarded_move_options(o);
  push.touch_force = met_part * o.forces.push;
  push.acceleration = o.motion.braking;
  push.delay = o.delay + 2 * o.cycle;
  return std::min(o.motion.push_speed, std::max(push.safe_speed(), o.motion.contact_speed));
}

GuardedMoveOptions guarded_move_options(const InsertionOptions& o) {
  return {guarded_speed(o),           o.motion.contact_speed,      o.motion.acceleration, o.forces.touch,
          most_part * o.limits.force, std::min(o.grip.axial, 1e9), loop_delay(o)};
}

Insertion::Machine::Machine(const InsertionOptions& given, const InsertionFrames& given_frames)
    : options(validated(given)),
      frames(given_frames),
      guard(safety_limits(given)),
      force_filter(given.cutoff, given.cycle),
      place_filter(given.cutoff, given.cycle),
      descent(guarded_move_options(given)),
      search(given.bodies, search_iterations, compliance_uncertainty(given)),
      careful(guarded_speed(given)),
      most_push(guarded_push_speed(given)) {
  frames.validate();
  path.cycle = options.cycle;
  restart();
}

void Insertion::Machine::restart() noexcept {
  const std::optional<Eigen::Vector3d> before = last_hole ? last_hole : options.hole;
  const Eigen::Vector3d hole = before.value_or(Eigen::Vector3d::Zero());
  state = InsertionState{};
  guard.reset();
  force_filter.reset();
  place_filter.reset();
  descent.reset();
  last_place.setConstant(std::numeric_limits<double>::quiet_NaN());
  zero.setZero();
  sum.setZero();
  squares.setZero();
  known = before.has_value();
  face = hole.z();
  state.hole = hole;
  place = hole.head<2>();
  toward = options.azimuth;
  compliance_error = 0.0;
  cycles = settled_cycles = 0;
  first = holding = true;
  probing = doubtful = spiralled = felt_again = air = false;
  if (options.bodies.peg_radius >= options.bodies.inner_radius) stop_for(Reason::PegTooWide);
  if (!stable(options)) stop_for(Reason::UnstableGain);
}

void Insertion::Machine::enter_phase(Phase phase) noexcept {
  state.phase = phase;
  begun_height = path.p.z();
  cycles = settled_cycles = late_cycles = 0;
}

void Insertion::Machine::stop_for(Reason reason) noexcept {
  state.stopped_in = state.phase;
  state.reason = reason;
  enter_phase(Phase::Stopped);
}

void Insertion::Machine::end_attempt(Reason reason) noexcept {
  if (state.attempt >= options.limits.attempts) return stop_for(reason);
  state.stopped_in = state.phase;
  state.reason = reason;
  ++state.attempt;
  known = false;
  enter_phase(Phase::Retreat);
}

bool Insertion::Machine::settled_for(double time, bool settled_now) noexcept {
  settled_cycles = settled_now ? settled_cycles + 1 : 0;
  return settled_cycles * options.cycle >= time;
}

ContactEstimate Insertion::Machine::contact_estimate(const Vector6& wrench, const Vector6& place6) const noexcept {
  ContactEstimate out;
  out.arm = place6.head<3>();
  out.force = wrench.head<3>();
  out.moment = wrench.tail<3>();
  const GripModel& grip = options.grip;
  const Eigen::Vector3d axis = tilted_pose(out.arm, place6.segment<2>(3)).linear().col(2);
  const Eigen::Vector3d arm = -grip.height * axis;  // from grip to bottom
  const Eigen::Vector3d turned = (out.moment + arm.cross(out.force)) / grip.angular;
  const double along = axis.dot(out.force);
  out.peg = out.arm;
  Eigen::Vector2d rho = place6.segment<2>(3);
  if (grip.corrected) {
    out.peg += along * (1 / grip.axial + compliance_error) * axis + (out.force - along * axis) / grip.lateral +
               turned.cross(arm);
    rho += turned.head<2>();
  }
  out.tilt = rho.norm();
  out.azimuth = std::atan2(-rho.x(), rho.y());
  return out;
}

ContactEstimate Insertion::Machine::estimate_contact(const PegReading& reading) noexcept {
  Vector6 place6;
  place6 << reading.T_tube_peg.translation(), tilt_of(reading.T_tube_peg), 0.0;
  const Vector6 wrench = force_filter.step(reading.wrench) - zero;
  sharp = contact_estimate(reading.wrench - zero, place6);
  return contact_estimate(wrench, place_filter.step(place6));
}

/// How much the force grows until a stop of now acts: by the speed at which the peg is driven into what it touches.
double Insertion::Machine::force_to_come(const PegReading& reading) noexcept {
  const Eigen::Vector3d p = reading.T_tube_peg.translation(), moved = p - last_place;
  last_place = p;
  const Eigen::Vector3d force = (reading.wrench - zero).head<3>();
  if (!moved.allFinite() || force.squaredNorm() == 0) return 0.0;
  const double speed = std::abs(moved.dot(force.normalized())) / options.cycle;
  return std::min(speed, options.motion.approach_speed) * 2 * options.cycle * options.grip.axial;
}

/// What ends everything, whatever the phase.
void Insertion::Machine::check_limits(const PegReading& reading, const ContactEstimate& now) noexcept {
  const Vector6 raw = reading.wrench - zero;
  const double coming = force_to_come(reading);
  switch (guard.step(reading.told.sensor, raw, reading.currents(), reading.told.status.saturated)) {
    case Violation::None:
      break;
    case Violation::Force:
      return stop_for(Reason::Force);
    case Violation::Torque:
      return stop_for(Reason::Torque);
    case Violation::Current:
      return stop_for(Reason::Current);
    case Violation::SensorDead:
      return stop_for(Reason::SensorDead);
    case Violation::SensorSaturated:
      return stop_for(Reason::SensorSaturated);
  }
  const double force = raw.head<3>().norm();
  if (force > options.forces.obstacle && force + coming > options.limits.force) return stop_for(Reason::Force);
  if (!reading.told.status.reachable || !reading.T_tube_peg.matrix().allFinite()) return stop_for(Reason::OutOfReach);
  if (!reading.told.status.gripped && holding) return stop_for(Reason::PegLost);
  if (state.time > options.limits.time) return stop_for(Reason::TimeOut);
  if (!now.peg.allFinite()) return stop_for(Reason::SensorDead);
}

void Insertion::Machine::run_phase(const PegReading& reading, const ContactEstimate& now) noexcept {
  switch (state.phase) {
    case Phase::Tare:
      return tare();
    case Phase::Approach:
      return approach();
    case Phase::Touch:
      return touch(now);
    case Phase::Roll:
      return roll(now);
    case Phase::Locate:
      return locate(now);
    case Phase::Aim:
      return aim(now);
    case Phase::Slide:
      return slide(now);
    case Phase::Upright:
      return upright(now);
    case Phase::Confirm:
      return confirm(now);
    case Phase::Push:
      return push(reading, now);
    case Phase::Spiral:
      return spiral(now);
    case Phase::Retreat:
      return retreat(now);
    case Phase::Done:
    case Phase::Stopped:
      return;
  }
}

/// After its end the peg comes to rest, and is watched as before.
void Insertion::Machine::come_to_rest(const PegReading& reading, const ContactEstimate& now) noexcept {
  path.drive(Eigen::Vector3d::Zero(), options.motion.acceleration);
  path.turn(Eigen::Vector2d::Zero(), options.motion.turning);
  if (state.reason == Reason::Inserted) check_limits(reading, now);
}

robot::RobotCommand Insertion::Machine::step(const robot::RobotReading& robot_reading) noexcept {
  const PegReading reading(frames, robot_reading);
  if (first && reading.T_tube_peg.matrix().allFinite()) path.rest_at(reading.T_tube_peg);
  if (state.phase != Phase::Stopped) {
    const ContactEstimate now = estimate_contact(reading);
    first = false;
    ++cycles;
    if (state.phase != Phase::Done) {
      state.time += options.cycle;
      check_limits(reading, now);
      run_phase(reading, now);
      state.depth = face - now.peg.z();
    } else {
      come_to_rest(reading, now);
    }
    if (!path.finite()) stop_for(Reason::SensorDead);
  }
  if (state.phase == Phase::Stopped) path.stand();
  robot::RobotCommand out =
      robot::tool_command(T_base_tool(frames, path.command(options.servo_frequency, options.servo_damping)));
  out.gripper = {holding, air};
  out.stop = state.phase == Phase::Stopped;
  return out;
}

}  // namespace kr5::force
