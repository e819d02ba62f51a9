// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/force/insertion.hpp>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <string>
#include <string_view>

#include <kr5/core/error.hpp>

#include "insertion_machine.hpp"

namespace kr5::force {
namespace {

constexpr int search_iterations = 40;
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
double softness_doubt(const InsertionOptions& o) { return o.grip.corrected ? doubtful_part / o.grip.axial : 0.0; }

SafetyLimits safety(const InsertionOptions& o) {
  return {o.limits.force, o.limits.torque, o.limits.current, o.limits.dead_after, o.cycle};
}

GuardedMoveOptions guarded(const InsertionOptions& o) {
  return {o.motion.approach_speed, o.motion.contact_speed,      o.motion.acceleration, o.forces.touch,
          0.8 * o.limits.force,    std::min(o.grip.axial, 1e9), loop_delay(o)};
}

const InsertionOptions& checked(const InsertionOptions& o) {
  o.validate();
  return o;
}

/// Every number of a part by its name. @param zero These may be 0. @param infinite Whether they may be infinite.
void check_numbers(const auto& part, const std::string& name, std::initializer_list<std::string_view> zero,
                   bool infinite = false) {
  std::remove_cvref_t<decltype(part)>::each_field(part, [&](const char* field, const auto& value, const char*) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, double>) {
      const bool may_be_zero = std::find(zero.begin(), zero.end(), field) != zero.end();
      require(infinite ? !std::isnan(value) : std::isfinite(value), name + "." + field + ": must be finite");
      require(value > 0 || (may_be_zero && value == 0),
              name + "." + field + (may_be_zero ? ": must not be negative" : ": must be positive"));
    }
  });
}

}  // namespace

void InsertionOptions::validate() const {
  bodies.validate();
  require(tilt > 0 && tilt < M_PI_2, "tilt: must lie between 0 and a quarter turn [rad]");
  require(std::isfinite(azimuth), "azimuth: must be finite [rad]");
  require(cycle > 0 && std::isfinite(cycle), "cycle: must be positive [s]");
  require(cutoff > 0 && cutoff < 0.5 / cycle, "cutoff: must lie between 0 and half the rate of the cycles [Hz]");
  require(delay >= 0 && std::isfinite(delay), "delay: must not be negative [s]");
  require(servo_frequency >= 0 && std::isfinite(servo_frequency), "servo_frequency: must not be negative [rad/s]");
  require(servo_damping >= 0 && std::isfinite(servo_damping), "servo_damping: must not be negative");
  require(!hole || hole->allFinite(), "hole: must be finite [m]");
  check_numbers(grip, "grip", {"height", "tilt_doubt", "place_doubt"}, true);
  check_numbers(forces, "forces", {"angular_gain"});
  check_numbers(motion, "motion", {"spiral_radius"});
  check_numbers(limits, "limits", {"face_error", "travel", "dead_after"});
  require(0.8 * limits.force > forces.touch, "limits.force: must be more than five quarters of forces.touch [N]");
  require((limits.current.array() > 0).all(), "limits.current: every limit must be positive [A]");
  require(limits.attempts >= 1, "limits.attempts: must be at least 1");
  safety(*this).validate();
  guarded(*this).validate();
}

Insertion::Machine::Machine(const InsertionOptions& given)
    : options(checked(given)),
      guard(safety(given)),
      force_filter(given.cutoff, given.cycle),
      place_filter(given.cutoff, given.cycle),
      descent(guarded(given)),
      search(given.bodies, search_iterations, softness_doubt(given)) {
  path.cycle = options.cycle;
  again();
}

void Insertion::Machine::again() noexcept {
  const std::optional<Eigen::Vector3d> before = last_hole ? last_hole : options.hole;
  const Eigen::Vector3d hole = before.value_or(Eigen::Vector3d::Zero());
  state = InsertionState{};
  guard.reset();
  force_filter.reset();
  place_filter.reset();
  descent.reset();
  zero.setZero();
  sum.setZero();
  squares.setZero();
  known = before.has_value();
  face = hole.z();
  state.hole = hole;
  place = hole.head<2>();
  toward = options.azimuth;
  softness = 0.0;
  cycles = calm = 0;
  first = holding = true;
  probing = doubtful = spiralled = air = false;
  if (options.bodies.peg_radius >= options.bodies.inner_radius) stop(Reason::PegTooWide);
  if (!stable(options)) stop(Reason::UnstableGain);
}

void Insertion::Machine::go(Phase phase) noexcept {
  state.phase = phase;
  cycles = calm = 0;
}

void Insertion::Machine::stop(Reason reason) noexcept {
  state.stopped_in = state.phase;
  state.reason = reason;
  go(Phase::Stopped);
}

void Insertion::Machine::fail(Reason reason) noexcept {
  if (state.attempt >= options.limits.attempts) return stop(reason);
  state.stopped_in = state.phase;
  state.reason = reason;
  ++state.attempt;
  known = false;
  go(Phase::Retreat);
}

bool Insertion::Machine::calm_for(double time, bool calm_now) noexcept {
  calm = calm_now ? calm + 1 : 0;
  return calm * options.cycle >= time;
}

Felt Insertion::Machine::felt(const Vector6& wrench, const Vector6& place6) const noexcept {
  Felt out;
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
    out.peg +=
        along * (1 / grip.axial + softness) * axis + (out.force - along * axis) / grip.lateral + turned.cross(arm);
    rho += turned.head<2>();
  }
  out.tilt = rho.norm();
  out.azimuth = std::atan2(-rho.x(), rho.y());
  return out;
}

Felt Insertion::Machine::feel(const InsertionReading& reading) noexcept {
  Vector6 place6;
  place6 << reading.T_T_P.translation(), tilt_of(reading.T_T_P), 0.0;
  const Vector6 wrench = force_filter.step(reading.wrench) - zero;
  sharp = felt(reading.wrench - zero, place6);
  return felt(wrench, place_filter.step(place6));
}

/// What ends everything, whatever the phase.
void Insertion::Machine::watch(const InsertionReading& reading, const Felt& now) noexcept {
  const Vector6 raw = reading.wrench - zero;
  switch (guard.step(reading.sensor, raw, reading.current, reading.saturated)) {
    case Violation::None:
      break;
    case Violation::Force:
      return stop(Reason::Force);
    case Violation::Torque:
      return stop(Reason::Torque);
    case Violation::Current:
      return stop(Reason::Current);
    case Violation::SensorDead:
      return stop(Reason::SensorDead);
    case Violation::SensorSaturated:
      return stop(Reason::SensorSaturated);
  }
  if (!reading.reachable || !reading.T_T_P.matrix().allFinite()) return stop(Reason::OutOfReach);
  if (!reading.gripped && holding) return stop(Reason::PegLost);
  if (state.time > options.limits.time) return stop(Reason::TimeOut);
  if (!now.peg.allFinite()) return stop(Reason::SensorDead);
}

void Insertion::Machine::act(const InsertionReading& reading, const Felt& now) noexcept {
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
void Insertion::Machine::rest(const InsertionReading& reading, const Felt& now) noexcept {
  path.drive(Eigen::Vector3d::Zero(), options.motion.acceleration);
  path.turn(Eigen::Vector2d::Zero(), options.motion.turning);
  if (state.reason == Reason::Inserted) watch(reading, now);
}

InsertionCommand Insertion::Machine::step(const InsertionReading& reading) noexcept {
  if (first && reading.T_T_P.matrix().allFinite()) path.rest_at(reading.T_T_P);
  if (state.phase != Phase::Stopped) {
    const Felt now = feel(reading);
    first = false;
    ++cycles;
    if (state.phase != Phase::Done) {
      state.time += options.cycle;
      watch(reading, now);
      act(reading, now);
      state.depth = face - now.peg.z();
    } else {
      rest(reading, now);
    }
    if (!path.finite()) stop(Reason::SensorDead);
  }
  if (state.phase == Phase::Stopped) path.stand();
  InsertionCommand out;
  out.T_T_P = path.command(options.servo_frequency, options.servo_damping);
  out.hold = holding;
  out.air = air;
  out.stop = state.phase == Phase::Stopped;
  return out;
}

Insertion::Insertion(const InsertionOptions& options) : machine_(std::make_unique<Machine>(options)) {}
Insertion::~Insertion() = default;
Insertion::Insertion(Insertion&&) noexcept = default;
Insertion& Insertion::operator=(Insertion&&) noexcept = default;

InsertionCommand Insertion::step(const InsertionReading& reading) noexcept { return machine_->step(reading); }
const InsertionState& Insertion::state() const noexcept { return machine_->state; }
bool Insertion::finished() const noexcept {
  return machine_->state.phase == Phase::Done || machine_->state.phase == Phase::Stopped;
}
std::span<const ProfileRow> Insertion::profile() const noexcept { return machine_->turn.rows(); }
void Insertion::again() noexcept { machine_->again(); }

}  // namespace kr5::force
