// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/cell/cell.hpp>
#include <kr5/job/supervisor.hpp>
#include <kr5/robot/servo_feedforward.hpp>

namespace kr5::work {

/// The cycle of a job: a supervisor, and the lead by which its way is told to the servo of the path before it. The
/// same for a simulated cell and for a link: equal readings, with equal answers in equal cycles, give equal commands.
/// `step` allocates nothing and throws nothing.
class WorkController {
 public:
  /// @param believed The servo of its path. @throws InvalidArgument as job::Supervisor.
  WorkController(const job::JobOptions& options, const job::RestartDecision& start, const cell::Cell& believed,
                 job::RecordRing& ring);

  robot::RobotCommand step(const robot::RobotReading& reading) noexcept;
  job::Supervisor& supervisor() noexcept { return supervisor_; }
  const job::Supervisor& supervisor() const noexcept { return supervisor_; }
  /// Where the supervisor wants the tool in this cycle, before the lead.
  const Pose& setpoint() const noexcept { return setpoint_; }

 private:
  void lead(robot::RobotCommand& command) noexcept;

  job::Supervisor supervisor_;
  robot::ServoFeedforward lead_;
  double cycle_;
  bool led_ = false;  ///< In the cycle before.
  Pose setpoint_ = Pose::Identity();
  Pose last_ = Pose::Identity(), before_last_ = Pose::Identity();  ///< Setpoints.
};

}  // namespace kr5::work
