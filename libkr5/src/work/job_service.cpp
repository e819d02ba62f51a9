// SPDX-License-Identifier: BSD-3-Clause
#include "work/job_service.hpp"

namespace kr5::work {

void JobService::serve(JobCycle& cycle) {
  cycle.take_rows([this](const CycleRow& row) {
    state_ = row.state;
    reading_ = row.reading;
    if (!(row.reading.time > time_)) return;  // of a controller that has restarted, or is gone
    time_ = row.reading.time;
    rows_.add(row.reading, row.setpoint, row.gripper, row.state, row.attempt);
  });
  perception_.answer(cycle.take_request().value_or(LookRequest()), cycle);
}

JobRun JobService::result(const job::RestartDecision& decision, const std::optional<JobCycle>& cycle,
                          const job::Journal& journal) const {
  JobRun out;
  out.decision = decision;
  if (cycle) out.state = cycle->state();
  out.rows = rows_.table();
  out.statistics = job::job_statistics(journal.records(), rows_.samples());
  return out;
}

}  // namespace kr5::work
