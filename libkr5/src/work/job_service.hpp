// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

#include <kr5/job/restart.hpp>
#include <kr5/work/job_runner.hpp>

#include "work/cell_perception.hpp"
#include "work/job_rows.hpp"

namespace kr5::work {

/// Time for which a link goes on after its job: the last commands still lead, and a stop must reach the controller [s].
inline constexpr double lead_rest = 0.5;

/// What the rest of a program does for the cycle of a job: it keeps the rows, and looks at what is asked for.
class JobService {
 public:
  /// Both must outlive it.
  JobService(SharedCell& cell, const WorkOptions& options)
      : perception_(cell, options), rows_(cell.believed().robot.joints()) {}

  /// What the robot tells before the first cycle.
  void begin(const robot::RobotReading& reading) noexcept { reading_ = reading; }
  /// What has come up since the last call; a look takes as long as it takes.
  void serve(JobCycle& cycle);
  /// State in the last cycle.
  const job::JobState& state() const noexcept { return state_; }
  /// What the robot told in that cycle, or before the first one.
  const robot::RobotReading& reading() const noexcept { return reading_; }
  const CellPerception& perception() const noexcept { return perception_; }
  /// What there is so far. @param cycle None where the job cannot go on; no other thread steps it or writes the
  /// journal.
  JobRun result(const job::RestartDecision& decision, const std::optional<JobCycle>& cycle,
                const job::Journal& journal) const;

 private:
  CellPerception perception_;
  JobRows rows_;
  job::JobState state_;
  robot::RobotReading reading_;
  double time_ = -std::numeric_limits<double>::infinity();  ///< Of the last row [s].
};

}  // namespace kr5::work
