// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/job/phase_table.hpp>

#include <array>
#include <cmath>
#include <string>

#include <kr5/core/error.hpp>

namespace kr5::job {
namespace {

using enum Phase;

/// The outcomes that a supervisor may give to each phase: a table without one of them could not be run.
const std::vector<Outcome>& possible_outcomes(Phase phase) {
  using enum Outcome;
  static const std::array<std::vector<Outcome>, phase_count> outcomes = {{
      {CellReady, Resumed, CellFault, Stop},
      {Resumed, NotSeen, Contradiction, Unreachable, Stop},
      {PicksFound, NothingGraspable, BinEmpty, Unreachable, Stop},
      {Gripped, NotGripped, NoPickLeft, Unreachable, Stop},
      {Stood, NotReleased, Dropped, Unreachable, Stop},
      {Gripped, HeldLying, NotGripped, Unreachable, Stop},
      {HoleFound, HoleMoved, HoleNotFound, Stood, Dropped, Unreachable, Stop},
      {InBore, NotInserted, Dropped, DroppedInBore, Stop},
      {AtDepth, LeftBore, NotInserted, Dropped, DroppedInBore, Stop},
      {NextPick, NextScan, AllInserted, NotReleased, NotSeen, Contradiction, Unreachable, Stop},
      {},
      {},
  }};
  return outcomes[static_cast<std::size_t>(phase)];
}

std::string where(const PhaseRow& row) { return "phase " + std::string(name_of(row.phase)) + ": "; }

void check_exits(const PhaseRow& row) {
  for (const Outcome outcome : possible_outcomes(row.phase)) {
    int found = 0;
    for (const PhaseExit& e : row.exits) found += e.outcome == outcome;
    require(found > 0, where(row) + "the outcome " + std::string(name_of(outcome)) + " has no exit");
    require(found == 1 || outcome == Outcome::Resumed,
            where(row) + "the outcome " + std::string(name_of(outcome)) + " has more than one exit");
  }
  for (const PhaseExit& e : row.exits) {
    bool possible = false;
    for (const Outcome outcome : possible_outcomes(row.phase)) possible = possible || e.outcome == outcome;
    require(possible, where(row) + "has no outcome " + std::string(name_of(e.outcome)));
  }
}

/// Whether a phase leads to another, over any number of exits.
bool leads_to(const PhaseTable& table, Phase from, Phase to) {
  std::array<bool, phase_count> reached{};
  reached[static_cast<std::size_t>(from)] = true;
  for (int pass = 0; pass < phase_count; ++pass)
    for (const PhaseRow& row : table.rows)
      for (const PhaseExit& e : row.exits)
        if (reached[static_cast<std::size_t>(row.phase)])
          reached[static_cast<std::size_t>(e.next)] = reached[static_cast<std::size_t>(e.exhausted)] = true;
  return reached[static_cast<std::size_t>(to)];
}

}  // namespace

void PhaseTable::validate() const {
  require(rows.size() == phase_count,
          "rows: found " + std::to_string(rows.size()) + ", expected one a phase: " + std::to_string(phase_count));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const PhaseRow& row = rows[i];
    require(row.phase == static_cast<Phase>(i),
            where(row) + "stands where " + std::string(name_of(static_cast<Phase>(i))) + " belongs");
    require(row.timeout >= 0 && std::isfinite(row.timeout), where(row) + "timeout must not be negative [s]");
    require(row.force >= 0 && std::isfinite(row.force), where(row) + "force must not be negative [N]");
    require(row.retries >= 0, where(row) + "retries must not be negative");
    check_exits(row);
  }
  for (const PhaseRow& row : rows)
    if (!row.exits.empty()) require(leads_to(*this, row.phase, Done), where(row) + "nothing leads from it to done");
}

const PhaseExit* PhaseTable::find_exit(Phase phase, Outcome outcome, Phase wanted) const noexcept {
  for (const PhaseExit& e : row(phase).exits)
    if (e.outcome == outcome && (outcome != Outcome::Resumed || e.next == wanted)) return &e;
  return nullptr;
}

PhaseTable usual_phases() {
  using enum Outcome;
  const PhaseExit stop = {Stop, Stopped};
  return {{
      {CheckCell,
       5.0,
       0.0,
       0,
       {{CellReady, Scan},
        {Resumed, Look},
        {Resumed, Scan},
        {Resumed, Stand},
        {Resumed, Regrip},
        {Resumed, Approach},
        {Resumed, Next},
        {CellFault, Stopped},
        stop}},
      {Look,
       60.0,
       30.0,
       1,
       {{Resumed, Regrip},
        {Resumed, Next},
        {NotSeen, Look, true},
        {Contradiction, Stopped},
        {Unreachable, Stopped},
        stop}},
      {Scan,
       60.0,
       30.0,
       3,
       {{PicksFound, Pick}, {NothingGraspable, Scan, true}, {BinEmpty, Done}, {Unreachable, Scan, true}, stop}},
      {Pick,
       15.0,
       30.0,
       6,
       {{Gripped, Stand}, {NotGripped, Pick, true}, {NoPickLeft, Scan, true}, {Unreachable, Pick}, stop}},
      {Stand,
       15.0,
       30.0,
       1,
       {{Stood, Regrip}, {NotReleased, Stand, true}, {Dropped, Next}, {Unreachable, Stopped}, stop}},
      {Regrip,
       15.0,
       30.0,
       2,
       {{Gripped, Approach}, {HeldLying, Stand}, {NotGripped, Regrip, true}, {Unreachable, Stopped}, stop}},
      {Approach,
       30.0,
       30.0,
       4,
       {{HoleFound, Search},
        {HoleMoved, Approach, true},
        {HoleNotFound, Approach, true},
        {Stood, Regrip, true},
        {Dropped, Next},
        {Unreachable, Stopped},
        stop}},
      {Search, 60.0, 0.0, 2, {{InBore, Insert}, {NotInserted, Stopped}, {Dropped, Next}, {DroppedInBore, Next}, stop}},
      {Insert,
       30.0,
       0.0,
       0,
       {{AtDepth, Next}, {LeftBore, Search}, {NotInserted, Stopped}, {Dropped, Next}, {DroppedInBore, Next}, stop}},
      {Next,
       30.0,
       30.0,
       1,
       {{NextPick, Pick},
        {NextScan, Scan},
        {AllInserted, Done},
        {NotReleased, Next, true},
        {NotSeen, Next, true},
        {Contradiction, Stopped},
        {Unreachable, Stopped},
        stop}},
      {Stopped, 0.0, 0.0, 0, {}},
      {Done, 0.0, 0.0, 0, {}},
  }};
}

}  // namespace kr5::job
