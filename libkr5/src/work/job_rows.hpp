// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/io/csv.hpp>
#include <kr5/job/job_statistics.hpp>
#include <kr5/job/supervisor.hpp>

namespace kr5::work {

/// One row for each cycle of a job.
class JobRows {
 public:
  explicit JobRows(Eigen::Index joints);

  /// @param setpoint Where the supervisor wants the tool.
  void add(const robot::RobotReading& reading, const Pose& setpoint, const robot::GripperCommand& gripper,
           const job::JobState& state, int attempt);
  io::Table table() const;
  job::JobSamples samples() const;

 private:
  Eigen::Index joints_;
  std::vector<std::string> columns_;
  std::vector<Eigen::VectorXd> rows_;
};

}  // namespace kr5::work
