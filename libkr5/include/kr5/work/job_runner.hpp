// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include <kr5/io/csv.hpp>
#include <kr5/job/job_statistics.hpp>
#include <kr5/job/journal.hpp>
#include <kr5/work/work_controller.hpp>
#include <kr5/work/work_options.hpp>

/// @file
/// A job from bin to tube in a simulated cell, whose readings, scans and pictures are all that its controller knows.

namespace kr5::work {

/// How a job ended, and what was measured meanwhile.
struct JobRun {
  job::RestartDecision decision;
  job::JobState state;
  job::JobStatistics statistics;
  io::Table rows;

  bool done() const { return state.phase == job::Phase::Done || decision.status == job::RestartStatus::Finished; }

  static void each_field(auto& self, auto&& visit) {
    visit("decision", self.decision, "Where the job went on.");
    visit("state", self.state, "How it ended.");
    visit("statistics", self.statistics, "Figures of the job.");
  }
};

/// What is so at the end of a job, for judges alone.
struct JobTruth {
  int in_tube = 0;
  int on_stand = 0;
  int in_bin = 0;
  int loose = 0;
  int lost = 0;
  double max_force = 0.0;  ///< [N]

  static void each_field(auto& self, auto&& visit) {
    visit("in_tube", self.in_tube, "Number of pellets that were let go in a bore, as `PelletTruth.tube` says.");
    visit("on_stand", self.on_stand, "Number of pellets on the stand.");
    visit("in_bin", self.in_bin, "Number of pellets in the bin.");
    visit("loose", self.loose, "Number of others that are held, or have not come to rest.");
    visit("lost", self.lost, "Number of pellets that lie elsewhere.");
    visit("max_force", self.max_force, "Maximum force between gripper and pellet since the last grip [N].");
  }
};

/// Told now and then how the job stands; an exception from it ends the program, and the journal stays.
using JobProgress = std::function<void(const job::JobState& state)>;

/// One program: it takes up what the journal says, and goes on cycle by cycle.
class JobRunner {
 public:
  /// Cell and journal must outlive it.
  /// @param seen What a person sees of stand and tube before a job goes on; its reading is that of the cell.
  /// @param cell_file To which the state of the cell is written before each record, so that a program that is killed
  /// leaves a cell that is never older than its journal; empty: none.
  /// @throws InvalidArgument for invalid options.
  JobRunner(sim::WorkCell& cell, const WorkOptions& options, job::Journal& journal,
            const job::RestartMeasurements& seen = {}, const std::filesystem::path& cell_file = {});
  ~JobRunner();
  JobRunner(JobRunner&&) noexcept;
  JobRunner& operator=(JobRunner&&) noexcept;

  const job::RestartDecision& decision() const noexcept;
  /// Whether the job can go on by that.
  bool runs() const noexcept;
  /// One cycle; nothing when it does not run, or has ended. @throws IoError when the journal cannot be written.
  void step();
  bool finished() const noexcept;
  const job::JobState& state() const;
  /// What the robot told in the last cycle of this program.
  const robot::RobotReading& reading() const;
  /// Of the pellet in work.
  const force::InsertionState& insertion() const;
  const robot::RobotCommand& command() const noexcept;

  /// Until the job ends. @throws IoError as step.
  JobRun run(const JobProgress& progress = {});
  /// What there is so far.
  JobRun result() const;

 private:
  struct Program;
  std::unique_ptr<Program> program_;
};

/// The arm stands at rest where the scan of the bin begins. @throws InvalidArgument when it cannot reach it.
void place_over_bin(sim::WorkCell& cell, const WorkOptions& options);

JobTruth judge_job(const sim::WorkCell& cell);

}  // namespace kr5::work
