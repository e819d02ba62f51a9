// SPDX-License-Identifier: BSD-3-Clause
#include "job/machine.hpp"

#include <string>

#include <kr5/core/error.hpp>

namespace kr5::job {
namespace {

/// The insertion works in the frame of the tube, wherever that is found; its attempts are the retries of the table.
force::InsertionOptions insertion_options(const JobOptions& options) {
  options.validate();
  force::InsertionOptions out = options.insertion;
  out.cycle = options.cycle;
  out.limits.attempts = options.phases.row(Phase::Search).retries + 1;
  return out;
}

const RestartDecision& startable(const RestartDecision& decision) {
  require(goes_on(decision.status), "start: the job cannot go on: " + std::string(name_of(decision.status)) + " (" +
                                        std::string(name_of(decision.finding)) + ")");
  return decision;
}

bool by_insertion(Phase phase) noexcept { return phase == Phase::Search || phase == Phase::Insert; }

PlannedPick plan_of(const StationPlan& s) noexcept {
  return {
      Pose::Identity(), {to_pose(s.put), to_pose(s.take)}, {to_pose(s.second_put), to_pose(s.second_take)}, s.visits};
}

StationPlan station_plan(const PlannedPick& p, int visit) noexcept {
  return {to_vector(p.first.T_base_put),
          to_vector(p.first.T_base_take),
          to_vector(p.second.T_base_put),
          to_vector(p.second.T_base_take),
          p.visits,
          visit};
}

PelletState state_after(Phase phase, Outcome outcome, PelletState before) noexcept {
  switch (outcome) {
    case Outcome::Gripped:
      return phase == Phase::Pick ? PelletState::Picked : PelletState::Regripped;
    case Outcome::HeldLying:
      return PelletState::Picked;
    case Outcome::Stood:
      return PelletState::Stood;
    case Outcome::AtDepth:
      return PelletState::Seated;
    case Outcome::Dropped:
      return by_insertion(phase) ? PelletState::Missing : PelletState::Dropped;
    case Outcome::DroppedInBore:
      return PelletState::MissingInBore;
    default:
      return before;
  }
}

/// Why the arm stops where a phase has no way on.
StopReason reason_of(Outcome outcome) noexcept {
  switch (outcome) {
    case Outcome::CellFault:
    case Outcome::Contradiction:
      return StopReason::CellFault;
    case Outcome::Unreachable:
      return StopReason::Unreachable;
    default:
      return StopReason::Exhausted;
  }
}

}  // namespace

Supervisor::Machine::Machine(const JobOptions& given, const RestartDecision& decision, RecordRing& given_ring)
    : options(given),
      start(startable(decision)),
      ring(given_ring),
      latch(given.stop),
      path(given.motion, given.cycle, given.arm),
      insertion(insertion_options(given)),
      T_base_tube(given.places.T_base_tube),
      tried(decision.tried) {
  take(decision);
  gripper = {decision.gripped, false, fingers};
}

/// The pellet is where a decision says, and goes on from there.
void Supervisor::Machine::take(const RestartDecision& decision) noexcept {
  start = decision;
  state.pellet = decision.pellet;
  state.pellet_state = decision.pellet_state;
  state.inserted = decision.inserted;
  planned = plan_of(decision.station);
  visit = decision.station.visit;
  fingers = decision.pellet_state > PelletState::Picked || visit > 0;
}

robot::RobotCommand Supervisor::Machine::step(const robot::RobotReading& reading) noexcept {
  ++cycle;
  time = reading.time;
  latch.step(reading, row().force);
  if (ring.failed()) latch.trip(StopReason::Journal);
  if (latch.latched()) return hold_stopped(reading);
  if (!begun) begin(reading);
  if (awaited != 0) {
    wait_for_record();
  } else {
    state.phase_time = seconds(++phase_cycles);
    if (row().timeout > 0 && state.phase_time > row().timeout) latch.trip(StopReason::TimeOut);
    const Outcome outcome = latch.latched() ? Outcome::None : run_phase(reading);
    if (outcome != Outcome::None) leave_phase(outcome);
    // The insertion commands ahead of the servo, from where it is no way to go on.
    if (by_insertion(state.phase) && awaited != 0 && !by_insertion(coming)) commanded = reading.T_base_tool;
  }
  if (latch.latched()) return hold_stopped(reading);
  robot::RobotCommand out = robot::tool_command(commanded);
  out.gripper = gripper;
  return out;
}

/// The first command is where the arm is, which a cell that is not as it is believed does not tell.
void Supervisor::Machine::begin(const robot::RobotReading& reading) noexcept {
  begun = true;
  commanded = reading.T_base_tool;
  path.start(commanded);
  coming = state.phase;
  write(RecordKind::Begin, start.phase);
  state.cell_fault = find_cell_fault(reading);
  if (state.cell_fault != CellFault::None) latch.trip(StopReason::CellFault);
}

robot::RobotCommand Supervisor::Machine::hold_stopped(const robot::RobotReading& reading) noexcept {
  if (state.phase != Phase::Stopped) {
    state.stopped_in = state.phase;
    state.phase = Phase::Stopped;
    state.outcome = Outcome::Stop;
    state.stop = latch.reason();
    state.recording = false;
    request = {};
  }
  if (!stop_written) {
    JobRecord record;
    record.time = reading.time;
    record.kind = RecordKind::Stop;
    record.phase = state.stopped_in;
    record.outcome = Outcome::Stop;
    record.stop = state.stop;
    stop_written = ring.push(record) != 0;
  }
  return latch.hold(gripper);
}

Outcome Supervisor::Machine::run_phase(const robot::RobotReading& reading) noexcept {
  switch (state.phase) {
    case Phase::CheckCell:
      return check_cell(reading);
    case Phase::Look:
      return look(reading);
    case Phase::Scan:
      return scan_bin(reading);
    case Phase::Pick:
      return pick(reading);
    case Phase::Stand:
      return stand(reading);
    case Phase::Regrip:
      return regrip(reading);
    case Phase::Approach:
      return approach(reading);
    case Phase::Search:
      return search(reading);
    case Phase::Insert:
      return insert(reading);
    case Phase::Next:
      return next(reading);
    case Phase::Stopped:
    case Phase::Done:
      return Outcome::None;
  }
  return Outcome::None;
}

bool Supervisor::Machine::take_retry(const PhaseExit& exit) noexcept {
  int& used = retries[static_cast<std::size_t>(state.phase)];
  if (!exit.retry) return true;
  if (used >= row().retries) return false;
  ++used;
  return true;
}

/// Which pellet is in work from now on.
void Supervisor::Machine::prepare_pellet(Outcome outcome, Phase next_phase) noexcept {
  const bool other = outcome == Outcome::NextPick || outcome == Outcome::NextScan || outcome == Outcome::AllInserted;
  if (other) {
    write(RecordKind::Pellet, state.phase);
    state.pellet = 0;
    state.pellet_state = PelletState::Waiting;
    retries = {};
  }
  if (outcome == Outcome::PicksFound) retries[static_cast<std::size_t>(Phase::Scan)] = 0;
  if (next_phase != Phase::Pick) return;
  if (state.pellet == 0) state.pellet = ++tried;
  has_plan = next_pick < scan.count;
  visit = 0;
  if (has_plan) planned = scan.picks[static_cast<std::size_t>(next_pick++)];
}

void Supervisor::Machine::leave_phase(Outcome outcome) noexcept {
  const PhaseExit* exit = options.phases.find_exit(state.phase, outcome, start.phase);
  const Phase next_phase = !exit ? Phase::Stopped : take_retry(*exit) ? exit->next : exit->exhausted;
  state.outcome = outcome;
  request = {};
  if (next_phase == Phase::Stopped) return latch.trip(reason_of(outcome));
  state.pellet_state = state_after(state.phase, outcome, state.pellet_state);
  if (outcome == Outcome::HeldLying) ++visit;
  prepare_pellet(outcome, next_phase);
  coming = next_phase;
  write(RecordKind::Enter, next_phase);
}

void Supervisor::Machine::write(RecordKind kind, Phase phase) noexcept {
  JobRecord record;
  record.time = time;
  record.kind = kind;
  record.phase = phase;
  record.outcome = state.outcome;
  record.pellet = state.pellet;
  record.pellet_state = state.pellet_state;
  record.attempt = retries[static_cast<std::size_t>(phase)] + 1;
  if (kind == RecordKind::Attempt) record.attempt = insertion_attempt;
  record.station = station_plan(planned, visit);
  const std::uint64_t number = ring.push(record);
  if (number == 0) return latch.trip(StopReason::Journal);
  if (kind != RecordKind::Begin && kind != RecordKind::Enter) return;
  awaited = number;
  wait_cycles = 0;
  state.recording = true;
}

/// The arm stands until what it will do next is on the disk.
void Supervisor::Machine::wait_for_record() noexcept {
  if (ring.written() >= awaited) return enter_phase();
  if (seconds(++wait_cycles) > options.record_time) latch.trip(StopReason::Journal);
}

void Supervisor::Machine::enter_phase() noexcept {
  state.phase = coming;
  state.recording = false;
  state.phase_time = 0.0;
  state.attempt = retries[static_cast<std::size_t>(coming)] + 1;
  awaited = 0;
  phase_cycles = stage = sweep_stage = unheld = grip_cycles = grip_seen = settle_cycles = 0;
  answered = dropping = no_way = false;
  path.start(commanded);
}

}  // namespace kr5::job
