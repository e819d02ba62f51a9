// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include <kr5/job/perception.hpp>
#include <kr5/work/work_controller.hpp>
#include <kr5/work/work_options.hpp>

/// @file
/// The cycle of a job in a thread that waits for nobody, and what it has to do with the rest of its program: looks and
/// ways that it asks for, what was seen, rows of what happened.

namespace kr5::work {

/// What happened in a cycle. Of fixed size.
struct CycleRow {
  robot::RobotReading reading;
  Pose setpoint = Pose::Identity();  ///< Of the supervisor.
  robot::GripperCommand gripper;
  job::JobState state;
  int attempt = 0;  ///< To insert.
};

/// What the supervisor wants to be looked at or planned, and where the arm was then.
struct LookRequest {
  job::PerceptionRequest request;
  robot::JointVector joints;  ///< [rad or m]
  Pose T_base_flange = Pose::Identity();
};

/// One thread, that of a link, calls `step`; one other calls the rest. Neither waits for the other: requests, results
/// and rows are handed over in memory that is there from the beginning. `step` allocates nothing and throws nothing.
class JobCycle {
 public:
  /// @param ring Must outlive it. @throws InvalidArgument as WorkController.
  JobCycle(const WorkOptions& options, const job::RestartDecision& start, const cell::Cell& believed,
           job::RecordRing& ring);
  ~JobCycle();
  JobCycle(JobCycle&&) noexcept;

  /// What was delivered before counts in this cycle.
  robot::RobotCommand step(const robot::RobotReading& reading) noexcept;

  /// What is to be looked at or planned, told once.
  std::optional<LookRequest> take_request() noexcept;
  /// False while the last result of this kind has not been taken.
  bool deliver(const job::ScanResult& result) noexcept;
  bool deliver(const job::HoleResult& result) noexcept;
  bool deliver(const job::PlaceResult& result) noexcept;
  bool deliver(const job::WayResult& result) noexcept;
  /// Rows since the last call, the oldest first.
  void take_rows(const std::function<void(const CycleRow& row)>& use);
  /// Rows for which there was no room, since nobody took any for long.
  std::uint64_t lost_rows() const noexcept;

  void stop_by_operator() noexcept;
  /// Whether nothing moves any more: done or stopped.
  bool finished() const noexcept;

  /// When no thread calls `step` any more: a job that is not finished has lost its link, which is written down.
  void end() noexcept;
  /// Of the thread of the cycle, or when there is none any more.
  const job::JobState& state() const noexcept;
  const force::InsertionState& insertion() const noexcept;

 private:
  struct Shared;
  std::unique_ptr<Shared> shared_;
};

}  // namespace kr5::work
