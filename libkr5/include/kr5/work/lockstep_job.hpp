// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string_view>

#include <kr5/rsi/link_session.hpp>
#include <kr5/work/job_runner.hpp>
#include <kr5/work/linked_options.hpp>

namespace kr5::work {

/// How a job through a link ended, and what both ends saw.
struct LinkedRun {
  JobRun job;
  rsi::LinkStatistics link;
  rsi::EmulatorStatistics controller;

  static void each_field(auto& self, auto&& visit) {
    visit("job", self.job, "How the job ended.");
    visit("link", self.link, "What the link has seen.");
    visit("controller", self.controller, "What the controller has seen.");
  }
};

/// An exchange of a link in lock step. The bytes are good during the call.
struct LockstepExchange {
  std::string_view telegram, answer;        ///< No answer: there is none.
  const job::ScanResult* scan = nullptr;    ///< Delivered after it.
  const job::HoleResult* hole = nullptr;    ///< The same.
  const job::PlaceResult* place = nullptr;  ///< The same.
  const job::WayResult* way = nullptr;      ///< The same.
};

/// A job through a link without sockets and clocks: a controller and the computer's end in turns, as fast as both can.
/// The telegrams are those of a real link, bit by bit, and go through the same classes; the same options and seeds give
/// the same run. Faults of the network are those of the options, those of the controller are made by `controller()`.
class LockstepJob {
 public:
  using Observer = std::function<void(const LockstepExchange& exchange)>;

  /// Cell and journal must outlive it. Where the job goes on is decided by the reading of the cell.
  /// @param seen What a person sees of stand and tube before a job goes on; its reading is that of the cell.
  /// @throws InvalidArgument for invalid options.
  LockstepJob(sim::WorkCell& cell, const WorkOptions& options, const LinkedOptions& linked, job::Journal& journal,
              const job::RestartMeasurements& seen = {}, Observer observe = {});
  ~LockstepJob();
  LockstepJob(LockstepJob&&) noexcept;

  const job::RestartDecision& decision() const noexcept;
  /// Whether the job can go on by that.
  bool runs() const noexcept;
  /// A cycle of both ends, also of a job that has ended. @throws IoError when the journal cannot be written.
  void step();
  bool finished() const noexcept;
  const job::JobState& state() const;

  /// Until the job has ended and the arm stands. @throws IoError as step.
  LinkedRun run(const JobProgress& progress = {});
  /// What there is so far.
  LinkedRun result() const;

  void stop_by_operator() noexcept;
  /// The clock of the computer jumps ahead [s].
  void jump_clock(double time) noexcept;
  rsi::EmulatedController& controller() noexcept;

 private:
  struct Program;
  std::unique_ptr<Program> program_;
};

}  // namespace kr5::work
