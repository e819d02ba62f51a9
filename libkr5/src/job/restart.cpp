// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/job/restart.hpp>

#include <cmath>

#include <kr5/core/error.hpp>

namespace kr5::job {
namespace {

/// What is measured, with what the decision says of the tool.
struct Evidence {
  std::optional<bool> station;
  std::optional<int> tube;
  bool sees_station, sees_tube;
};

RestartDecision refused(RestartDecision d, RestartFinding finding) noexcept {
  d.status = RestartStatus::Contradiction;
  d.finding = finding;
  d.phase = Phase::Stopped;
  return d;
}

/// What must be seen first: by the job itself where it can, or by a person.
RestartDecision unseen(RestartDecision d, RestartFinding finding, bool sees) noexcept {
  d.status = sees ? RestartStatus::Look : RestartStatus::Unseen;
  d.finding = finding;
  d.phase = sees ? Phase::Look : Phase::Stopped;
  return d;
}

RestartDecision go_on(RestartDecision d, RestartFinding finding, Phase phase, PelletState state) noexcept {
  d.status = RestartStatus::Continue;
  d.finding = finding;
  d.phase = phase;
  d.pellet_state = state;
  if (state == PelletState::Inserted && finding == RestartFinding::WasInserted) ++d.inserted;
  return d;
}

/// Between pellets, or before the first: whatever the bin holds, a new scan tells.
RestartDecision from_scan(const RestartDecision& d) noexcept {
  if (d.gripped) return refused(d, RestartFinding::GripUnexpected);
  return go_on(d, RestartFinding::AsBelieved, Phase::Scan, d.pellet_state);
}

RestartDecision from_pick(const RestartDecision& d) noexcept {
  if (d.gripped) return go_on(d, RestartFinding::WasPicked, Phase::Stand, PelletState::Picked);
  return go_on(d, RestartFinding::AsBelieved, Phase::Scan, PelletState::Waiting);
}

RestartDecision from_stand(const RestartDecision& d, const Evidence& e) noexcept {
  if (d.gripped && e.station.value_or(false)) return refused(d, RestartFinding::StationOccupied);
  if (d.gripped) return go_on(d, RestartFinding::AsBelieved, Phase::Stand, PelletState::Picked);
  if (!e.station) return unseen(d, RestartFinding::StationUnseen, e.sees_station);
  if (*e.station) return go_on(d, RestartFinding::WasStood, Phase::Regrip, PelletState::Stood);
  return go_on(d, RestartFinding::WasDropped, Phase::Next, PelletState::Dropped);
}

RestartDecision from_regrip(const RestartDecision& d, const Evidence& e) noexcept {
  if (d.gripped && e.station.value_or(false)) return refused(d, RestartFinding::StationOccupied);
  if (d.gripped && d.station.visit + 1 < d.station.visits) {
    RestartDecision again = go_on(d, RestartFinding::WasRegripped, Phase::Stand, PelletState::Picked);
    ++again.station.visit;
    return again;
  }
  if (d.gripped) return go_on(d, RestartFinding::WasRegripped, Phase::Approach, PelletState::Regripped);
  if (!e.station) return unseen(d, RestartFinding::StationUnseen, e.sees_station);
  if (*e.station) return go_on(d, RestartFinding::AsBelieved, Phase::Regrip, PelletState::Stood);
  return go_on(d, RestartFinding::WasDropped, Phase::Next, PelletState::Lost);
}

/// The pellet was on its way into the tube.
RestartDecision from_tube(const RestartDecision& d, const Evidence& e) noexcept {
  if (e.station.value_or(false)) {
    if (d.gripped || d.interrupted != Phase::Approach) return refused(d, RestartFinding::StationOccupied);
    return go_on(d, RestartFinding::WasStood, Phase::Regrip, PelletState::Stood);
  }
  if (d.gripped && d.pellet_state == PelletState::Seated && d.in_bore)
    return go_on(d, RestartFinding::AsBelieved, Phase::Next, PelletState::Seated);
  if (d.gripped) return go_on(d, RestartFinding::AsBelieved, Phase::Approach, PelletState::Regripped);
  if (!e.tube) return unseen(d, RestartFinding::TubeUnseen, e.sees_tube);
  if (*e.tube > d.inserted) return go_on(d, RestartFinding::WasInserted, Phase::Next, PelletState::Inserted);
  return go_on(d, RestartFinding::WasDropped, Phase::Next, PelletState::Dropped);
}

/// The pellet is where it stays, and the tool has not left it yet.
RestartDecision from_end(const RestartDecision& d) noexcept {
  if (d.gripped) return refused(d, RestartFinding::GripUnexpected);
  return go_on(d, RestartFinding::AsBelieved, Phase::Next, d.pellet_state);
}

/// Only the pellet that is in work can have come into the tube since the last record.
bool possible_count(const RestartDecision& d, const Evidence& e) noexcept {
  if (!e.tube) return true;
  const bool may_be_in = d.pellet_state >= PelletState::Regripped && d.pellet_state <= PelletState::MissingInBore;
  const int more = *e.tube - d.inserted;
  return more == 0 || (more == 1 && may_be_in);
}

RestartDecision by_phase(const RestartDecision& d, const Evidence& e) noexcept {
  switch (d.interrupted) {
    case Phase::CheckCell:
    case Phase::Look:
    case Phase::Scan:
    case Phase::Stopped:
    case Phase::Done:
      return from_scan(d);
    case Phase::Pick:
      return from_pick(d);
    case Phase::Stand:
      return from_stand(d, e);
    case Phase::Regrip:
      return from_regrip(d, e);
    case Phase::Approach:
    case Phase::Search:
    case Phase::Insert:
      return from_tube(d, e);
    case Phase::Next:
      return finished(d.pellet_state) ? from_end(d) : from_tube(d, e);
  }
  return refused(d, RestartFinding::PoseInvalid);
}

bool is_in_bore(const RestartOptions& options, const Pose& T_base_tool) {
  const Eigen::Vector3d p = (options.T_base_tube.inverse() * T_base_tool * options.T_tool_peg).translation();
  return p.head<2>().norm() < options.bore && p.z() < 0;
}

}  // namespace

void RestartOptions::validate() const {
  require(is_rotation(T_base_tube.linear()) && T_base_tube.translation().allFinite(), "T_base_tube is no rigid motion");
  require(is_rotation(T_tool_peg.linear()) && T_tool_peg.translation().allFinite(), "T_tool_peg is no rigid motion");
  require(bore > 0 && std::isfinite(bore), "bore must be positive [m]");
}

RestartDecision decide_restart(const JobBelief& belief, const RestartMeasurements& measurements,
                               const RestartOptions& options) {
  options.validate();
  const Pose& T_base_tool = measurements.reading.T_base_tool;
  RestartDecision d;
  d.pellet = belief.pellet;
  d.pellet_state = belief.pellet_state();
  d.inserted = belief.inserted;
  d.tried = static_cast<int>(belief.pellets.size());
  d.station = belief.station;
  d.gripped = measurements.reading.status.gripped;
  d.interrupted = belief.phase;
  d.in_bore = d.pellet_state == PelletState::MissingInBore ||
              (d.pellet_state != PelletState::Missing && is_in_bore(options, T_base_tool));
  d.station_seen = measurements.station;
  if (!T_base_tool.matrix().allFinite()) return refused(d, RestartFinding::PoseInvalid);
  if (belief.stop != StopReason::None) {
    d.status = RestartStatus::Latched;
    d.stop = belief.stop;
    d.phase = Phase::Stopped;
    return d;
  }
  const Evidence evidence{measurements.station, measurements.tube, options.sees_station, options.sees_tube};
  if (!possible_count(d, evidence)) return refused(d, RestartFinding::TubeCount);
  if (belief.phase == Phase::Done) {
    d.status = RestartStatus::Finished;
    d.phase = Phase::Done;
    return d;
  }
  if (belief.begun) return by_phase(d, evidence);
  if (d.gripped) return refused(d, RestartFinding::GripUnexpected);
  d.status = RestartStatus::Fresh;
  return d;
}

RestartDecision decide_after_look(const RestartDecision& before, const PlaceResult& seen,
                                  const TubeStack& stack) noexcept {
  RestartDecision d = before;
  Evidence evidence{d.station_seen, std::nullopt, true, true};
  if (before.finding == RestartFinding::StationUnseen) {
    evidence.station = d.station_seen = seen.occupied;
  } else {
    const TubeFinding finding = judge_tube(seen, d.inserted, stack, d.in_bore);
    if (finding == TubeFinding::Stuck) return refused(d, RestartFinding::TubeStuck);
    evidence.tube = d.inserted + (finding == TubeFinding::OneMore ? 1 : 0);
  }
  return by_phase(d, evidence);
}

}  // namespace kr5::job
