// SPDX-License-Identifier: BSD-3-Clause
/// @file The phases from the bin to the station.
#include "job/machine.hpp"

namespace kr5::job {

CellFault Supervisor::Machine::find_cell_fault(const robot::RobotReading& reading) const noexcept {
  const robot::JointVector& q = reading.joints;
  if (!q.allFinite() || !reading.wrench.allFinite() || !reading.T_base_tool.matrix().allFinite())
    return CellFault::Numbers;
  if (options.lowest_joints.size() > 0) {
    if (q.size() != options.lowest_joints.size()) return CellFault::Joints;
    if ((q.array() < options.lowest_joints.array()).any() || (q.array() > options.highest_joints.array()).any())
      return CellFault::Joints;
  }
  if (!(reading.pose_mismatch <= options.pose_mismatch)) return CellFault::Pose;
  const Eigen::Array3d p = reading.T_base_tool.translation().array();
  if ((p < options.stop.lowest.array()).any() || (p > options.stop.highest.array()).any()) return CellFault::Workspace;
  // A pellet that an interruption left in the mouth of the bore may lean on it.
  const bool may_touch = start.phase == Phase::Approach || start.phase == Phase::Next;
  if (!may_touch && reading.wrench.head<3>().norm() > options.check_force) return CellFault::Loaded;
  return reading.status.gripped == start.gripped ? CellFault::None : CellFault::Grip;
}

Outcome Supervisor::Machine::check_cell(const robot::RobotReading& reading) noexcept {
  state.cell_fault = find_cell_fault(reading);
  if (state.cell_fault != CellFault::None) return Outcome::CellFault;
  if (state.phase_time < options.check_time) return Outcome::None;
  return start.status == RestartStatus::Fresh ? Outcome::CellReady : Outcome::Resumed;
}

/// Over the place where the pellet of a job that was interrupted may be, and over the next one where it is not there.
Outcome Supervisor::Machine::look(const robot::RobotReading& reading) noexcept {
  const bool station = start.finding == RestartFinding::StationUnseen;
  const std::optional<ScanLine>& line = station ? options.places.station_scan : options.places.tube_scan;
  if (!line) return Outcome::NotSeen;
  if (!sweep(*line, station ? RequestKind::Station : RequestKind::Tube, reading)) return on_the_way();
  if (!place.seen) return Outcome::NotSeen;
  const RestartDecision found = decide_after_look(start, place, options.stack);
  sweep_stage = 0;
  answered = false;
  if (found.status == RestartStatus::Contradiction) {
    state.cell_fault = found.finding == RestartFinding::StationOccupied ? CellFault::Station : CellFault::Tube;
    return Outcome::Contradiction;
  }
  take(found);
  return found.status == RestartStatus::Look ? Outcome::None : Outcome::Resumed;
}

/// Each other scan is made from where that is seen which was hidden; a bin is empty when both show nothing.
Outcome Supervisor::Machine::scan_bin(const robot::RobotReading& reading) noexcept {
  const JobPlaces& places = options.places;
  const bool again = places.T_base_rescan && state.attempt % 2 == 0;
  const Pose& begin = again ? *places.T_base_rescan : places.T_base_scan;
  if (stage == 0) set_grip(false);
  stage = 1;
  const Pose& end = again ? *places.T_base_rescan_end : places.T_base_scan_end;
  if (!sweep({begin, end}, RequestKind::Scan, reading)) return on_the_way();
  next_pick = 0;
  if (scan.count > 0) return Outcome::PicksFound;
  if (scan.unreachable > 0) return Outcome::Unreachable;
  return scan.bin_empty && (again || !places.T_base_rescan) ? Outcome::BinEmpty : Outcome::NothingGraspable;
}

Outcome Supervisor::Machine::pick(const robot::RobotReading& reading) noexcept {
  if (!has_plan) return Outcome::NoPickLeft;
  if (stage == 0) {
    fingers = false;
    set_grip(false);
    travel_to(planned.T_base_grasp, true);  // the scan shows what lies there
    stage = 1;
  }
  if (!follow(reading)) return on_the_way();
  if (stage == 1) {
    set_grip(true);
    stage = 2;
  } else if (stage == 3) {
    return Outcome::NotGripped;
  }
  if (grip_is(reading, true)) return Outcome::Gripped;
  if (seconds(grip_cycles) > options.grip_time) {
    set_grip(false);
    lift();
    stage = 3;
  }
  return Outcome::None;
}

/// What is picked is known to be held before it leaves the bin; what stands is known to be let go before the tool
/// leaves it. So an interruption finds one or the other.
Outcome Supervisor::Machine::stand(const robot::RobotReading& reading) noexcept {
  if (stage == 0) {
    travel_to(planned.visit(visit).T_base_put, station_known);
    stage = 1;
  }
  if (stage == 1) {
    if (lost_pellet(reading)) {
      if (!path.standing()) return Outcome::None;
      return at_station(planned.visit(visit).T_base_put) ? Outcome::Stood : Outcome::Dropped;
    }
    if (!follow(reading)) return on_the_way();
    set_grip(false);
    stage = 2;
  }
  if (grip_is(reading, false)) {
    station_known = true;
    return Outcome::Stood;
  }
  if (seconds(grip_cycles) <= options.grip_time) return Outcome::None;
  set_grip(true);
  return Outcome::NotReleased;
}

Outcome Supervisor::Machine::regrip(const robot::RobotReading& reading) noexcept {
  if (stage == 0) {
    fingers = true;
    set_grip(false);
    travel_to(planned.visit(visit).T_base_take, station_known);
    stage = 1;
  }
  if (!follow(reading)) return on_the_way();
  if (stage == 1) {
    set_grip(true);
    stage = 2;
  } else if (stage == 3) {
    return Outcome::NotGripped;
  }
  if (grip_is(reading, true)) return visit + 1 < planned.visits ? Outcome::HeldLying : Outcome::Gripped;
  if (seconds(grip_cycles) > options.grip_time) {
    set_grip(false);
    lift();
    stage = 3;
  }
  return Outcome::None;
}

}  // namespace kr5::job
