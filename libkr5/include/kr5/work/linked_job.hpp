// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <kr5/rsi/link.hpp>
#include <kr5/work/lockstep_job.hpp>

namespace kr5::work {

/// A job in real time through a link with its sockets: an emulated controller moves the simulated cell in a thread of
/// its own, the cycle of the job runs in that of the link, records are written in a third one. Scans and pictures are
/// taken and evaluated by whoever calls `serve`, meanwhile the arm stands.
///
/// A job whose controller is silent for as long as the options of the link say has lost its link: it is stopped, and
/// stays so until a person has released it. The same where a controller comes back after that, or has restarted.
class LinkedJob {
 public:
  /// Begins at once. Cell and journal must outlive it; nobody else uses them meanwhile. Where the job goes on is
  /// decided by the reading of the cell before the controller begins.
  /// @param seen What a person sees of stand and tube before a job goes on; its reading is that of the cell.
  /// @param observe Called in the thread of the link once a datagram.
  /// @param cell_file As of JobRunner. @throws InvalidArgument for invalid options; IoError when the port is not free.
  LinkedJob(sim::WorkCell& cell, const WorkOptions& options, const LinkedOptions& linked, job::Journal& journal,
            const job::RestartMeasurements& seen = {}, rsi::ExchangeFunction observe = {},
            const std::filesystem::path& cell_file = {});
  ~LinkedJob();
  LinkedJob(LinkedJob&&) noexcept;

  const job::RestartDecision& decision() const noexcept;
  /// Whether the job can go on by that.
  bool runs() const noexcept;
  bool finished() const noexcept;
  /// State in the last cycle that was served.
  const job::JobState& state() const;
  /// What the robot told in the last cycle that was served.
  const robot::RobotReading& reading() const;

  /// What has come up since the last call, which must be a few milliseconds ago: looks, rows, a lost link.
  /// @throws IoError when the controller has ended itself, saying why.
  void serve();
  /// Until the job has ended and the arm stands. An exception from `progress` ends it, too. @throws IoError as serve.
  LinkedRun run(const JobProgress& progress = {});
  /// Ends both threads; what was not finished is a lost link. What there is then.
  LinkedRun end();

  void stop_by_operator() noexcept;
  /// Number of the last record on the disk.
  std::uint64_t written() const noexcept;
  /// The cell as it is now, while the controller moves it.
  sim::WorkCellState cell_state();
  /// What is so in the cell now. Not for controllers.
  sim::WorkCellTruth cell_truth();
  /// The controller, while it runs.
  rsi::Emulator& controller();
  rsi::LinkStatistics link_statistics() const;
  /// What the kernel gave to the thread of the link.
  rsi::RealTimeStatus real_time() const;
  /// What the journal says that is wrong, in words; empty: nothing.
  std::string journal_problem() const;

 private:
  struct Program;
  std::unique_ptr<Program> program_;
};

}  // namespace kr5::work
