// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include <kr5/geometry/pose.hpp>
#include <kr5/job/phase.hpp>
#include <kr5/job/stop_latch.hpp>

/// @file
/// What is written of a job, before it happens. Of fixed size: copying it allocates nothing.

namespace kr5::job {

enum class RecordKind {
  Begin,    ///< A program takes the job up: at its start, or after an interruption.
  Enter,    ///< A phase begins.
  Attempt,  ///< Another attempt within a phase.
  Pellet,   ///< A pellet is where it stays.
  Stop,     ///< The stop has latched.
  Release,  ///< A person has released it.
};
constexpr auto enum_names(RecordKind) {
  using enum RecordKind;
  return names<RecordKind>({{Begin, "begin"},
                            {Enter, "enter"},
                            {Attempt, "attempt"},
                            {Pellet, "pellet"},
                            {Stop, "stop"},
                            {Release, "release"}});
}

/// How a pellet goes over the station, as it is written down: poses of the tool, translation and rotation vector each.
struct StationPlan {
  Vector6 put = Vector6::Zero();          ///< [m, rad]
  Vector6 take = Vector6::Zero();         ///< [m, rad]
  Vector6 second_put = Vector6::Zero();   ///< [m, rad]
  Vector6 second_take = Vector6::Zero();  ///< [m, rad]
  int visits = 1;
  int visit = 0;

  static void each_field(auto& self, auto&& visit) {
    visit("put", self.put, "Tool that puts the pellet on the station [m, rad].");
    visit("take", self.take, "Tool that takes it there [m, rad].");
    visit("second_put", self.second_put, "The same of a second visit [m, rad].");
    visit("second_take", self.second_take, "The same of a second visit [m, rad].");
    visit("visits", self.visits, "Number of visits: 1 | 2.");
    visit("visit", self.visit, "Number of the visit that is due or under way, from 0.");
  }
};

struct JobRecord {
  std::uint64_t number = 0;
  double time = 0.0;  ///< [s]
  RecordKind kind = RecordKind::Begin;
  Phase phase = Phase::CheckCell;
  Outcome outcome = Outcome::None;
  int pellet = 0;
  PelletState pellet_state = PelletState::Waiting;
  int attempt = 0;
  StopReason stop = StopReason::None;
  StationPlan station;

  static void each_field(auto& self, auto&& visit) {
    visit("number", self.number, "Number of the record, from 1.");
    visit("time", self.time, "Time of the reading in which it was made [s].");
    visit("kind", self.kind, "Kind: begin | enter | attempt | pellet | stop | release.");
    visit("phase", self.phase, "Phase that begins, or goes on.");
    visit("outcome", self.outcome, "Outcome of the phase before.");
    visit("pellet", self.pellet, "Number of the pellet in work, from 1; 0: none.");
    visit("pellet_state", self.pellet_state, "Where it is.");
    visit("attempt", self.attempt, "Number of the attempt, from 1.");
    visit("stop", self.stop, "Reason of the stop.");
    visit("station", self.station, "How the pellet in work goes over the station.");
  }
};

}  // namespace kr5::job
