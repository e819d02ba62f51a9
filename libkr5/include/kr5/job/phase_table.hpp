// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/job/phase.hpp>

/// @file
/// The state machine of a job as a table. The supervisor runs by it, the diagram is drawn from it.

namespace kr5::job {

/// What follows an outcome.
struct PhaseExit {
  Outcome outcome = Outcome::None;
  Phase next = Phase::Stopped;
  bool retry = false;
  Phase exhausted = Phase::Stopped;

  static void each_field(auto& self, auto&& visit) {
    visit("outcome", self.outcome, "Reason for leaving the phase.");
    visit("next", self.next, "Phase that follows.");
    visit("retry", self.retry, "Whether it counts as a retry of the phase.");
    visit("exhausted", self.exhausted, "Phase that follows when no retry is left.");
  }
};

struct PhaseRow {
  Phase phase = Phase::Stopped;
  double timeout = 0.0;  ///< [s]
  double force = 0.0;    ///< [N]
  int retries = 0;
  std::vector<PhaseExit> exits;

  static void each_field(auto& self, auto&& visit) {
    visit("phase", self.phase, "Phase.");
    visit("timeout", self.timeout, "Time after which the arm is stopped; 0: none [s].");
    visit("force", self.force, "Force that stops the arm; 0: that of the stop alone [N].");
    visit("retries", self.retries, "Number of retries for one pellet.");
    visit("exits", self.exits, "Reasons for leaving, with the phase that each leads to.");
  }
};

struct PhaseTable {
  std::vector<PhaseRow> rows;  ///< By phase.

  /// @throws InvalidArgument naming phase and field: for a phase that is missing, an outcome that has no exit or stands
  /// twice, a limit that is negative, a phase from which nothing leads to the end.
  void validate() const;

  const PhaseRow& row(Phase phase) const noexcept { return rows[static_cast<std::size_t>(phase)]; }
  /// The exit of a phase for an outcome; with several of `Resumed`, that to `wanted`. Null when there is none.
  const PhaseExit* find_exit(Phase phase, Outcome outcome, Phase wanted = Phase::Stopped) const noexcept;

  static void each_field(auto& self, auto&& visit) { visit("rows", self.rows, "One row a phase."); }
};

/// The table of the job from bin to tube.
PhaseTable usual_phases();

}  // namespace kr5::job
