// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/work/work_controller.hpp>

#include <utility>

#include "work/servo_lead.hpp"

namespace kr5::work {
namespace {

/// From one pose to another, as changes along and about the axes of the base.
Vector6 change(const Pose& from, const Pose& to) noexcept {
  Vector6 out;
  out << to.translation() - from.translation(), log_rotation(to.linear() * from.linear().transpose());
  return out;
}

/// The insertion leads the servo itself.
bool leads_itself(job::Phase phase) noexcept { return phase == job::Phase::Search || phase == job::Phase::Insert; }

}  // namespace

WorkController::WorkController(const job::JobOptions& options, const job::RestartDecision& start,
                               const cell::Cell& believed, job::RecordRing& ring)
    : supervisor_(options, start, ring), lead_(servo_lead(believed)), cycle_(options.cycle) {}

robot::RobotCommand WorkController::step(const robot::RobotReading& reading) noexcept {
  const bool before = leads_itself(supervisor_.state().phase);
  robot::RobotCommand command = supervisor_.step(reading);
  setpoint_ = command.tool;
  if (before || command.stop || command.space != robot::CommandSpace::Tool)
    led_ = false;
  else
    lead(command);
  return command;
}

/// The setpoint of the cycle before is told: speed and acceleration there are differences to both sides, without which
/// the lead itself would be late, and the arm would overshoot by millimetres.
void WorkController::lead(robot::RobotCommand& command) noexcept {
  if (!std::exchange(led_, true)) before_last_ = last_ = setpoint_;
  const Vector6 here = change(before_last_, last_), next = change(last_, setpoint_);
  const Vector6 speed = (here + next) / (2 * cycle_), acceleration = (next - here) / (cycle_ * cycle_);
  const Vector6 ahead = lead_(speed, acceleration);
  command.tool.translation() = last_.translation() + ahead.head<3>();
  command.tool.linear() = exp_rotation(ahead.tail<3>()) * last_.linear();
  before_last_ = std::exchange(last_, setpoint_);
}

}  // namespace kr5::work
