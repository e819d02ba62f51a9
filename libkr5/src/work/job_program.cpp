// SPDX-License-Identifier: BSD-3-Clause
#include "work/job_program.hpp"

#include <string>

#include <kr5/core/error.hpp>
#include <kr5/job/journal_writer.hpp>

namespace kr5::work {

bool JobProgram::begin(const WorkOptions& options, job::RestartMeasurements seen) {
  ring.begin_after(journal.last_number());
  seen.reading = cell.read();
  service.begin(seen.reading);
  decision = job::decide_restart(journal.belief(), seen, restart_options(options));
  if (decision.status == job::RestartStatus::Fresh || decision.status == job::RestartStatus::Continue)
    cycle.emplace(options, decision, cell.believed(), ring);
  return cycle.has_value();
}

void JobProgram::require_cycle() const {
  require(cycle.has_value(), "job: it cannot go on: " + std::string(name_of(decision.status)));
}

void JobProgram::write() {
  std::string problem;
  job::write_records(ring, journal, problem);
  if (!problem.empty()) throw IoError(problem);
}

}  // namespace kr5::work
