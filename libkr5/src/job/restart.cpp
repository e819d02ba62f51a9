// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/job/restart.hpp>

#include <cmath>

#include <kr5/core/error.hpp>

namespace kr5::job {
namespace {

/// What is known when the decision is made.
struct Evidence {
  const JobBelief& belief;
  const RestartMeasurements& measured;
  bool gripped;
  bool in_bore;  ///< The tool is where a pellet that it holds would be in the tube.
};

RestartDecision refused(RestartDecision d, RestartFinding finding) {
  const bool unseen = finding == RestartFinding::StationUnseen || finding == RestartFinding::TubeUnseen;
  d.status = unseen ? RestartStatus::Unseen : RestartStatus::Contradiction;
  d.finding = finding;
  d.phase = Phase::Stopped;
  return d;
}

RestartDecision go_on(RestartDecision d, RestartFinding finding, Phase phase, PelletState state) {
  d.status = RestartStatus::Continue;
  d.finding = finding;
  d.phase = phase;
  d.pellet_state = state;
  if (state == PelletState::Inserted && finding == RestartFinding::WasInserted) ++d.inserted;
  return d;
}

/// Between pellets, or before the first: whatever the bin holds, a new scan tells.
RestartDecision from_scan(const RestartDecision& d, const Evidence& e) {
  if (e.gripped) return refused(d, RestartFinding::GripUnexpected);
  return go_on(d, RestartFinding::AsBelieved, Phase::Scan, d.pellet_state);
}

RestartDecision from_pick(const RestartDecision& d, const Evidence& e) {
  if (e.gripped) return go_on(d, RestartFinding::WasPicked, Phase::Stand, PelletState::Picked);
  return go_on(d, RestartFinding::AsBelieved, Phase::Scan, PelletState::Waiting);
}

RestartDecision from_stand(const RestartDecision& d, const Evidence& e) {
  if (e.gripped && e.measured.station.value_or(false)) return refused(d, RestartFinding::StationOccupied);
  if (e.gripped) return go_on(d, RestartFinding::AsBelieved, Phase::Stand, PelletState::Picked);
  if (!e.measured.station) return refused(d, RestartFinding::StationUnseen);
  if (*e.measured.station) return go_on(d, RestartFinding::WasStood, Phase::Regrip, PelletState::Stood);
  return go_on(d, RestartFinding::WasDropped, Phase::Next, PelletState::Dropped);
}

RestartDecision from_regrip(const RestartDecision& d, const Evidence& e) {
  if (e.gripped && e.measured.station.value_or(false)) return refused(d, RestartFinding::StationOccupied);
  if (e.gripped && d.station.visit + 1 < d.station.visits) {
    RestartDecision again = go_on(d, RestartFinding::WasRegripped, Phase::Stand, PelletState::Picked);
    ++again.station.visit;
    return again;
  }
  if (e.gripped) return go_on(d, RestartFinding::WasRegripped, Phase::Approach, PelletState::Regripped);
  if (!e.measured.station) return refused(d, RestartFinding::StationUnseen);
  if (*e.measured.station) return go_on(d, RestartFinding::AsBelieved, Phase::Regrip, PelletState::Stood);
  return go_on(d, RestartFinding::WasDropped, Phase::Next, PelletState::Lost);
}

/// The pellet was on its way into the tube.
RestartDecision from_tube(const RestartDecision& d, const Evidence& e) {
  if (e.measured.station.value_or(false)) {
    if (e.gripped || e.belief.phase != Phase::Approach) return refused(d, RestartFinding::StationOccupied);
    return go_on(d, RestartFinding::WasStood, Phase::Regrip, PelletState::Stood);
  }
  if (e.gripped && d.pellet_state == PelletState::Seated && e.in_bore)
    return go_on(d, RestartFinding::AsBelieved, Phase::Next, PelletState::Seated);
  if (e.gripped) return go_on(d, RestartFinding::AsBelieved, Phase::Approach, PelletState::Regripped);
  if (!e.measured.tube) return refused(d, RestartFinding::TubeUnseen);
  if (*e.measured.tube > d.inserted) return go_on(d, RestartFinding::WasInserted, Phase::Next, PelletState::Inserted);
  return go_on(d, RestartFinding::WasDropped, Phase::Next, PelletState::Dropped);
}

/// The pellet is where it stays, and the tool has not left it yet.
RestartDecision from_end(const RestartDecision& d, const Evidence& e) {
  if (e.gripped) return refused(d, RestartFinding::GripUnexpected);
  return go_on(d, RestartFinding::AsBelieved, Phase::Next, d.pellet_state);
}

/// Only the pellet that is in work can have come into the tube since the last record.
bool possible_count(const RestartDecision& d, const Evidence& e) {
  if (!e.measured.tube) return true;
  const bool may_be_in = d.pellet_state >= PelletState::Regripped && d.pellet_state <= PelletState::Missing;
  const int more = *e.measured.tube - d.inserted;
  return more == 0 || (more == 1 && may_be_in);
}

RestartDecision by_phase(const RestartDecision& d, const Evidence& e) {
  switch (e.belief.phase) {
    case Phase::CheckCell:
    case Phase::Scan:
    case Phase::Stopped:
    case Phase::Done:
      return from_scan(d, e);
    case Phase::Pick:
      return from_pick(d, e);
    case Phase::Stand:
      return from_stand(d, e);
    case Phase::Regrip:
      return from_regrip(d, e);
    case Phase::Approach:
    case Phase::Search:
    case Phase::Insert:
      return from_tube(d, e);
    case Phase::Next:
      return finished(d.pellet_state) ? from_end(d, e) : from_tube(d, e);
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
  if (!T_base_tool.matrix().allFinite()) return refused(d, RestartFinding::PoseInvalid);
  if (belief.stop != StopReason::None) {
    d.status = RestartStatus::Latched;
    d.stop = belief.stop;
    d.phase = Phase::Stopped;
    return d;
  }
  const Evidence evidence = {belief, measurements, d.gripped, is_in_bore(options, T_base_tool)};
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

}  // namespace kr5::job
