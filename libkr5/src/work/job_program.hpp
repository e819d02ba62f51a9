// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>

#include <kr5/job/journal.hpp>
#include <kr5/job/record_ring.hpp>

#include "work/job_service.hpp"

namespace kr5::work {

/// What every program of a job has, by itself or through a link.
struct JobProgram {
  /// @param cell_file To which the state of the cell is written before each record; empty: none.
  /// @throws InvalidArgument for invalid options.
  JobProgram(sim::WorkCell& given, const WorkOptions& options, job::Journal& to,
             const std::filesystem::path& cell_file = {});
  ~JobProgram() { journal.set_before_append({}); }
  JobProgram(const JobProgram&) = delete;

  /// Takes up what the journal says, by the reading of the cell. @return Whether the job can go on.
  bool begin(const WorkOptions& options, job::RestartMeasurements seen);
  bool finished() const noexcept { return !cycle || cycle->finished(); }
  /// @throws InvalidArgument for a job that cannot go on.
  void require_cycle() const;
  /// What is on its way to the journal is written there. @throws IoError.
  void write();
  /// What there is so far; no other thread steps the cycle or writes the journal.
  JobRun result() const { return service.result(decision, cycle, journal); }

  SharedCell cell;
  job::Journal& journal;
  JobService service;
  job::RecordRing ring;
  job::RestartDecision decision;
  std::optional<JobCycle> cycle;  ///< None: the job cannot go on.
};

}  // namespace kr5::work
