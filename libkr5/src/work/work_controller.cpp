// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/work/work_controller.hpp>

namespace kr5::work {
namespace {

robot::ServoFeedforward lead_of(const cell::Cell& believed) {
  if (!believed.servo || !believed.servo->tool) return {0.0, 1.0};
  return {believed.servo->tool->natural_frequency, believed.servo->tool->damping_ratio};
}

/// The insertion leads the servo itself.
bool leads_itself(job::Phase phase) noexcept { return phase == job::Phase::Search || phase == job::Phase::Insert; }

}  // namespace

WorkController::WorkController(const job::JobOptions& options, const job::RestartDecision& start,
                               const cell::Cell& believed, job::RecordRing& ring)
    : supervisor_(options, start, ring), lead_(lead_of(believed)), cycle_(options.cycle) {}

robot::RobotCommand WorkController::step(const robot::RobotReading& reading) noexcept {
  const bool before = leads_itself(supervisor_.state().phase);
  robot::RobotCommand command = supervisor_.step(reading);
  setpoint_ = command.tool;
  if (before || command.stop || command.target != robot::CommandTarget::Tool)
    count_ = 0;
  else
    lead(command);
  return command;
}

/// Speed and acceleration are differences of the setpoints, which are smooth.
void WorkController::lead(robot::RobotCommand& command) noexcept {
  Vector6 speed = Vector6::Zero(), acceleration = Vector6::Zero();
  if (count_ > 0) {
    speed << setpoint_.translation() - last_.translation(),
        log_rotation(setpoint_.linear() * last_.linear().transpose());
    speed /= cycle_;
  }
  if (count_ > 1) acceleration = (speed - last_speed_) / cycle_;
  const Vector6 ahead = lead_(speed, acceleration);
  command.tool.translation() += ahead.head<3>();
  command.tool.linear() = exp_rotation(ahead.tail<3>()) * setpoint_.linear();
  last_ = setpoint_;
  last_speed_ = speed;
  if (count_ < 2) ++count_;
}

}  // namespace kr5::work
