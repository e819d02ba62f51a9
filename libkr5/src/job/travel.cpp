// SPDX-License-Identifier: BSD-3-Clause
/// @file Ways from place to place, clear of what stands there, and the gripper.
#include <algorithm>

#include "job/machine.hpp"

namespace kr5::job {
namespace {

constexpr double level = 1e-6;  // [m]
constexpr int convincing = 3;   // cycles of one word from the gripper

}  // namespace

bool Supervisor::Machine::near_tube(const Pose& T_base_tool) const noexcept {
  const Eigen::Vector3d p = (T_base_tube.inverse() * T_base_tool * options.places.T_tool_peg).translation();
  return p.head<2>().norm() < options.places.near_tube && p.z() < options.places.look_height;
}

/// From wherever it stands up to the height of travel: out of the tube along its axis, from anything else against its
/// approach. A pellet that is held in the tube comes out slowly.
void Supervisor::Machine::lift() noexcept {
  path.start(commanded);
  Pose now = commanded;
  Eigen::Vector3d direction = -now.linear().col(2);
  if (near_tube(now)) {
    direction = T_base_tube.linear().col(2);
    const double depth = (T_base_tube.inverse() * now * options.places.T_tool_peg).translation().z();
    now.translation() += (options.places.look_height - depth) * direction;
    path.add(now, gripper.hold ? Way::Slow : Way::Free);
  }
  if (options.places.travel_height - now.translation().z() > level) path.add(options.places.lifted(now, direction));
}

void Supervisor::Machine::travel_over(const Pose& T_base_tool) noexcept {
  lift();
  go_over(options.places.over(T_base_tool));
}

/// At the height of travel: as the joints go, where the arm is known, and a way of them is asked for.
void Supervisor::Machine::go_over(const Pose& T_base_over) noexcept {
  no_way = false;
  if (!options.arm) return path.add(T_base_over);
  request = {
      RequestKind::Way, cycle, state.pellet, {path.end(), T_base_over, state.phase, planned, visit, T_base_tube}};
  path.add(T_base_over, Way::Joint);
}

/// Nothing yet, unless the arm stands, and there is no way for it.
Outcome Supervisor::Machine::on_the_way() const noexcept {
  return no_way && path.waiting() ? Outcome::Unreachable : Outcome::None;
}

/// Along a line over a place, and until it is told what was seen on the way.
bool Supervisor::Machine::sweep(const ScanLine& line, RequestKind asks, const robot::RobotReading& reading) noexcept {
  if (sweep_stage == 0) {
    travel_over(line.T_base_begin);
    path.add(line.T_base_begin);
    sweep_stage = 1;
  }
  if (!follow(reading)) return false;
  if (sweep_stage == 1) {
    if (!line.T_base_end.isApprox(line.T_base_begin)) request = {RequestKind::Sweep, cycle, state.pellet};
    path.start(commanded);
    path.add(line.T_base_end, Way::Scan);
    sweep_stage = 2;
    return false;
  }
  if (sweep_stage == 2) {
    request = {asks, cycle, state.pellet};
    sweep_stage = 3;
  }
  return answered;
}

/// Over it, down to the approach, with care where it is not known that nothing else is there, and from there slowly
/// until it is touched.
void Supervisor::Machine::travel_to(const Pose& T_base_tool, bool known_clear) noexcept {
  travel_over(T_base_tool);
  const Eigen::Vector3d along = T_base_tool.linear().col(2);
  Pose before = T_base_tool, beyond = T_base_tool;
  before.translation() -= options.places.approach * along;
  beyond.translation() += options.places.overtravel * along;
  path.add(before, known_clear ? Way::Free : Way::Careful);
  path.add(beyond, Way::Guarded);
}

/// A cycle along the path; whether the arm has come to its end, too. What it meets on the way is for a person to see
/// to.
bool Supervisor::Machine::follow(const robot::RobotReading& reading) noexcept {
  commanded = path.step(reading.wrench.head<3>());
  if (path.obstructed()) latch.trip(StopReason::Obstructed);
  if (!path.standing()) {
    settle_cycles = 0;
    return false;
  }
  const double off = (reading.T_base_tool.translation() - commanded.translation()).norm();
  return off < options.settled || seconds(++settle_cycles) > options.settle_time;
}

/// Whether a pellet that should be held is gone. The arm comes to rest before it says so.
bool Supervisor::Machine::lost_pellet(const robot::RobotReading& reading) noexcept {
  unheld = reading.status.gripped ? 0 : unheld + 1;
  dropping = dropping || unheld >= convincing;
  if (dropping) {
    commanded = path.brake();
    station_known = false;
  }
  return dropping;
}

/// Whether a pellet that the tool loses here stands on the station.
bool Supervisor::Machine::at_station(const Pose& T_base_tool) const noexcept {
  return (commanded.translation() - T_base_tool.translation()).norm() < options.places.approach;
}

void Supervisor::Machine::set_grip(bool hold) noexcept {
  gripper = {hold, false, fingers};
  grip_cycles = grip_seen = 0;
}

bool Supervisor::Machine::grip_is(const robot::RobotReading& reading, bool gripped) noexcept {
  ++grip_cycles;
  grip_seen = reading.status.gripped == gripped ? grip_seen + 1 : 0;
  return grip_seen >= convincing;
}

}  // namespace kr5::job
