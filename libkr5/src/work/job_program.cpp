// SPDX-License-Identifier: BSD-3-Clause
#include "work/job_program.hpp"

#include <string>

#include <kr5/core/error.hpp>
#include <kr5/job/journal_writer.hpp>

namespace kr5::work {

JobProgram::JobProgram(sim::WorkCell& given, const WorkOptions& options, job::Journal& to,
                       const std::filesystem::path& cell_file)
    : cell(given), journal(to), service((options.validate(), cell), options) {
  if (cell_file.empty()) return;
  journal.set_before_append([this, cell_file] {
    sim::save_state(cell.with_cell([](const sim::WorkCell& c) { return c.state(); }), cell_file);
  });
}

bool JobProgram::begin(const WorkOptions& options, job::RestartMeasurements seen) {
  ring.begin_after(journal.last_number());
  seen.reading = cell.read();
  service.begin(seen.reading);
  decision = job::decide_restart(journal.belief(), seen, restart_options(options));
  if (job::goes_on(decision.status)) cycle.emplace(options, decision, cell.believed(), ring);
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
