// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include <kr5/work/linked_options.hpp>

/// @file
/// What a job does when its link or its controller fails while a pellet is inserted.

namespace kr5::work {

/// A fault of the network between controller and computer, or of one of them.
enum class TrialFault {
  Late,  ///< Messages of the link, some in succession, as are those of the next four.
  Lost,
  Doubled,
  Reordered,
  Truncated,
  EmergencyStop,
  DrivesOff,
  Restart,    ///< Of the program of the controller.
  ClockJump,  ///< Of the computer.
};
constexpr auto enum_names(TrialFault) {
  using enum TrialFault;
  return names<TrialFault>({{Late, "late"},
                            {Lost, "lost"},
                            {Doubled, "doubled"},
                            {Reordered, "reordered"},
                            {Truncated, "truncated"},
                            {EmergencyStop, "emergency_stop"},
                            {DrivesOff, "drives_off"},
                            {Restart, "restart"},
                            {ClockJump, "clock_jump"}});
}

struct FaultTrialOptions {
  int trials = 100;
  int messages = 20;
  std::uint64_t seed = 1;

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("trials", self.trials, "Trials of each fault.");
    visit("messages", self.messages, "Most messages in succession that have a fault of the network.");
    visit("seed", self.seed, "Random seed of instants, directions and numbers.");
  }
};

/// What came of the trials of one fault. Judged by the truth of the simulator, which no controller reads.
struct FaultRow {
  TrialFault fault = TrialFault::Late;
  int trials = 0;
  int continued = 0;
  int stopped = 0;
  int moving = 0;
  double max_force = 0.0;  ///< [N]
  int over_limit = 0;
  int resumed = 0;
  int astray = 0;

  static void each_field(auto& self, auto&& visit) {
    visit("fault", self.fault, "Fault.");
    visit("trials", self.trials, "Number of trials.");
    visit("continued", self.continued, "Trials in which the job went on, and inserted its pellet.");
    visit("stopped", self.stopped, "Trials in which it was stopped.");
    visit("moving", self.moving, "Those of them in which the arm did not come to rest.");
    visit("max_force", self.max_force, "Maximum force on the tool from the fault on [N].");
    visit("over_limit", self.over_limit,
          "Trials in which the force was above the limit of the insertion for more than one cycle.");
    visit("resumed", self.resumed, "Stopped jobs that were done once a person had released the stop.");
    visit("astray", self.astray, "Trials after which journal and cell do not agree on the pellets.");
  }
};

/// Told how far the trials are [-].
using TrialProgress = std::function<void(double share)>;

/// Injects each fault at random instants of an insertion through a link in lock step; what was stopped is released by
/// a person, and goes on.
/// @param folder For the journals. @throws InvalidArgument, also for a cell whose pellet does not come to the tube
/// without faults; IoError when a journal cannot be written.
std::vector<FaultRow> run_fault_trials(const cell::Cell& cell, const sim::WorkCellOptions& bin,
                                       const std::filesystem::path& folder, const FaultTrialOptions& options = {},
                                       const TrialProgress& progress = {});

}  // namespace kr5::work
