// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include <kr5/job/record.hpp>

namespace kr5::job {

struct PelletEntry {
  int number = 0;
  PelletState state = PelletState::Waiting;
  int picks = 0;
  int insertions = 0;
  double begin = 0.0;  ///< [s]
  double end = 0.0;    ///< [s]

  static void each_field(auto& self, auto&& visit) {
    visit("number", self.number, "Number of the pellet, from 1.");
    visit("state", self.state, "Where it is.");
    visit("picks", self.picks, "Number of attempts to pick it.");
    visit("insertions", self.insertions, "Number of attempts to insert it.");
    visit("begin", self.begin, "Time of its first pick [s].");
    visit("end", self.end, "Time of its last record [s].");
  }
};

/// How a job stands, by its records.
struct JobBelief {
  bool begun = false;
  Phase phase = Phase::CheckCell;
  int pellet = 0;
  std::vector<PelletEntry> pellets;
  int inserted = 0;
  StopReason stop = StopReason::None;
  StationPlan station;

  /// State of the pellet in work; waiting when there is none.
  PelletState pellet_state() const noexcept;

  static void each_field(auto& self, auto&& visit) {
    visit("begun", self.begun, "Whether there is any record.");
    visit("phase", self.phase, "Phase that began last, but for stops and looks.");
    visit("pellet", self.pellet, "Number of the pellet in work; 0: none.");
    visit("pellets", self.pellets, "Every pellet that was tried.");
    visit("inserted", self.inserted, "Number of pellets in the tube.");
    visit("stop", self.stop, "Stop that nobody has released.");
    visit("station", self.station, "How the pellet in work goes over the station.");
  }
};

/// What the records say, the oldest first.
JobBelief believe(std::span<const JobRecord> records);

}  // namespace kr5::job
