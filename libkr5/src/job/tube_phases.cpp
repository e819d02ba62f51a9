// SPDX-License-Identifier: BSD-3-Clause
/// @file The phases from the station into the tube, and away from it.
#include "job/machine.hpp"

namespace kr5::job {
namespace {

constexpr double sure = 3.0;  // standard deviations within which a look tells nothing new

StopReason stop_of(force::Reason reason) noexcept {
  switch (reason) {
    case force::Reason::Force:
      return StopReason::Force;
    case force::Reason::Torque:
      return StopReason::Torque;
    case force::Reason::Current:
      return StopReason::Current;
    case force::Reason::SensorDead:
      return StopReason::SensorDead;
    case force::Reason::SensorSaturated:
      return StopReason::SensorSaturated;
    case force::Reason::OutOfReach:
      return StopReason::Unreachable;
    case force::Reason::Obstructed:
      return StopReason::Obstructed;
    case force::Reason::TimeOut:
      return StopReason::TimeOut;
    default:
      return StopReason::None;
  }
}

}  // namespace

/// Looks, goes there, and looks again until the tube is where the arm is (Hayat et al. 2022, section 6.3).
Outcome Supervisor::Machine::approach(const robot::RobotReading& reading) noexcept {
  if (lost_pellet(reading)) {
    if (!path.standing()) return Outcome::None;
    return at_station(planned.visit(visit).T_base_take) ? Outcome::Stood : Outcome::Dropped;
  }
  if (stage == 0) {
    const Pose look = look_pose();
    const bool there = (commanded.translation() - look.translation()).norm() < options.places.near_tube;
    if (!there || near_tube(commanded)) travel_over(look);
    path.add(look, Way::Careful);
    stage = 1;
  }
  if (!follow(reading)) return on_the_way();
  if (stage == 1) {
    request = {RequestKind::Hole, cycle, state.pellet};
    stage = 2;
  }
  return answered ? judge_hole() : Outcome::None;
}

/// A hole that was felt is known better than it can be seen, unless it is seen elsewhere.
Outcome Supervisor::Machine::judge_hole() noexcept {
  if (!hole.found || !hole.T_base_tube.matrix().allFinite()) return Outcome::HoleNotFound;
  const double off = (hole.T_base_tube.translation() - T_base_tube.translation()).norm();
  if (hole_felt && off < sure * hole.position_std) return Outcome::HoleFound;
  hole_felt = false;
  T_base_tube = hole.T_base_tube;
  return off > options.hole_moved ? Outcome::HoleMoved : Outcome::HoleFound;
}

/// One cycle of the insertion, which knows the tube and the pellet alone.
void Supervisor::Machine::step_insertion(const robot::RobotReading& reading) noexcept {
  const Pose T_tube_base = T_base_tube.inverse();
  const Pose T_base_peg = reading.T_base_tool * options.places.T_tool_peg;
  const Eigen::Vector3d arm = T_base_peg.translation() - reading.T_base_tool.translation();
  const Eigen::Vector3d force = reading.wrench.head<3>(), moment = reading.wrench.tail<3>();
  robot::RobotReading seen = reading;
  seen.T_base_tool = T_tube_base * T_base_peg;
  seen.wrench << T_tube_base.linear() * force, T_tube_base.linear() * (moment - arm.cross(force));
  const robot::RobotCommand command = insertion.step(seen);
  commanded = T_base_tube * command.tool * options.places.T_tool_peg.inverse();
  gripper = command.gripper;
  gripper.fingers = fingers;
  if (insertion.state().attempt == insertion_attempt) return;
  insertion_attempt = insertion.state().attempt;
  write(RecordKind::Attempt, state.phase);
}

/// Why the insertion ended without success.
Outcome Supervisor::Machine::insertion_end() noexcept {
  const force::Reason reason = insertion.state().reason;
  if (reason == force::Reason::PegLost)
    return insertion.state().depth > 0.0 ? Outcome::DroppedInBore : Outcome::Dropped;
  if (const StopReason stop = stop_of(reason); stop != StopReason::None) latch.trip(stop);
  return Outcome::NotInserted;
}

Outcome Supervisor::Machine::search(const robot::RobotReading& reading) noexcept {
  if (stage == 0 && state.outcome != Outcome::LeftBore) {
    insertion.restart();
    insertion_attempt = 1;
  }
  stage = 1;
  step_insertion(reading);
  const force::Phase phase = insertion.state().phase;
  if (phase == force::Phase::Stopped) return insertion_end();
  return phase == force::Phase::Push || phase == force::Phase::Done ? Outcome::InBore : Outcome::None;
}

Outcome Supervisor::Machine::insert(const robot::RobotReading& reading) noexcept {
  step_insertion(reading);
  const force::Phase phase = insertion.state().phase;
  if (phase == force::Phase::Stopped) return insertion_end();
  if (phase == force::Phase::Done) return Outcome::AtDepth;
  return phase == force::Phase::Push ? Outcome::None : Outcome::LeftBore;
}

/// False until the gripper has let go.
bool Supervisor::Machine::release_pellet(const robot::RobotReading& reading) noexcept {
  if (!grip_is(reading, false)) return false;
  if (state.pellet_state == PelletState::Seated) {
    state.pellet_state = PelletState::Inserted;
    ++state.inserted;
    hole_felt = true;
  }
  return true;
}

/// Whether a pellet that the gripper lost at the tube is in it, once that was seen.
Outcome Supervisor::Machine::look_for_pellet(const robot::RobotReading& reading) noexcept {
  if (!options.places.tube_scan) return Outcome::NotSeen;
  if (!sweep(*options.places.tube_scan, RequestKind::Tube, reading)) return on_the_way();
  switch (judge_tube(place, state.inserted, options.stack, state.pellet_state == PelletState::MissingInBore)) {
    case TubeFinding::Unseen:
      return Outcome::NotSeen;
    case TubeFinding::Stuck:
      state.cell_fault = CellFault::Tube;
      return Outcome::Contradiction;
    case TubeFinding::OneMore:
      state.pellet_state = PelletState::Inserted;
      ++state.inserted;
      return Outcome::None;
    case TubeFinding::Same:
      state.pellet_state = PelletState::Dropped;
      return Outcome::None;
  }
  return Outcome::None;
}

/// Lets go, leaves, counts.
Outcome Supervisor::Machine::next(const robot::RobotReading& reading) noexcept {
  if (stage == 0) {
    set_grip(false);
    stage = 1;
  }
  if (stage == 1) {
    if (!release_pellet(reading)) {
      if (seconds(grip_cycles) <= options.grip_time) return Outcome::None;
      set_grip(true);
      return Outcome::NotReleased;
    }
    lift();
    stage = 2;
  }
  if (missing(state.pellet_state)) {
    const Outcome seen = look_for_pellet(reading);
    if (seen != Outcome::None || missing(state.pellet_state)) return seen;
  } else {
    follow(reading);
    if (!path.standing()) return on_the_way();
  }
  if (options.pellets > 0 && state.inserted >= options.pellets) return Outcome::AllInserted;
  return next_pick < scan.count ? Outcome::NextPick : Outcome::NextScan;
}

}  // namespace kr5::job
