// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/job/stop_latch.hpp>

#include <cmath>

#include <kr5/core/error.hpp>

namespace kr5::job {
namespace {

StopReason reason_of(force::Violation violation) noexcept {
  switch (violation) {
    case force::Violation::None:
      return StopReason::None;
    case force::Violation::Force:
      return StopReason::Force;
    case force::Violation::Torque:
      return StopReason::Torque;
    case force::Violation::Current:
      return StopReason::Current;
    case force::Violation::SensorDead:
      return StopReason::SensorDead;
    case force::Violation::SensorSaturated:
      return StopReason::SensorSaturated;
  }
  return StopReason::SensorDead;
}

}  // namespace

void StopLimits::validate() const {
  sensor.validate();
  require(speed > 0 && speed <= 100, "speed must lie between 0 and 100 m/s, so that it is a limit");
  require(turning_speed > 0 && turning_speed <= 1000, "turning_speed must lie between 0 and 1000 rad/s");
  require(lowest.allFinite() && highest.allFinite() && (lowest.array() < highest.array()).all(),
          "highest must lie above lowest in each axis [m]");
  require(silence > 0 && silence <= 60, "silence must lie between 0 and 60 s");
}

StopLatch::StopLatch(const StopLimits& limits, StopReason standing)
    : limits_(limits), sensor_(limits.sensor), reason_(standing) {
  limits.validate();
}

bool StopLatch::too_fast(const robot::RobotReading& reading) const noexcept {
  const double dt = reading.time - last_time_;
  if (!(dt > 0)) return false;
  const Eigen::Vector3d way = reading.T_base_tool.translation() - last_.translation();
  const Eigen::AngleAxisd turn(last_.linear().transpose() * reading.T_base_tool.linear());
  return way.norm() > limits_.speed * dt || std::abs(turn.angle()) > limits_.turning_speed * dt;
}

StopReason StopLatch::find_reason(const robot::RobotReading& reading, double force) noexcept {
  const auto currents =
      std::span<const double>(reading.currents.data(), static_cast<std::size_t>(reading.currents.size()));
  const force::Violation violation = sensor_.step(reading.sensor, reading.wrench, currents, reading.status.saturated);
  const StopReason asked = asked_.load(std::memory_order_acquire);
  if (asked != StopReason::None) return asked;
  if (violation != force::Violation::None) return reason_of(violation);
  if (force > 0 && reading.wrench.head<3>().norm() > force) return StopReason::Force;
  if (!reading.T_base_tool.matrix().allFinite() || !std::isfinite(reading.time)) return StopReason::LostLink;
  const Eigen::Array3d p = reading.T_base_tool.translation().array();
  if ((p < limits_.lowest.array()).any() || (p > limits_.highest.array()).any()) return StopReason::Workspace;
  if (reading.status.stopped) return StopReason::Robot;
  if (!reading.status.reachable) return StopReason::Unreachable;
  if (!begun_) return StopReason::None;
  const double dt = reading.time - last_time_;
  if (dt > limits_.silence || dt < 0) return StopReason::LostLink;
  return too_fast(reading) ? StopReason::Speed : StopReason::None;
}

StopReason StopLatch::step(const robot::RobotReading& reading, double force) noexcept {
  const StopReason now = find_reason(reading, force);
  if (reading.T_base_tool.matrix().allFinite() && std::isfinite(reading.time)) {
    last_ = reading.T_base_tool;
    last_time_ = reading.time;
    begun_ = true;
  }
  if (reason_ == StopReason::None) reason_ = now;
  if (reason_ != StopReason::None && !held_ && begun_) held_ = last_;
  return reason_;
}

void StopLatch::trip(StopReason reason) noexcept {
  if (reason_ == StopReason::None) reason_ = reason;
  if (reason_ != StopReason::None && !held_ && begun_) held_ = last_;
}

robot::RobotCommand StopLatch::hold(const robot::GripperCommand& gripper) const noexcept {
  robot::RobotCommand out = held_ ? robot::tool_command(*held_) : robot::RobotCommand{};
  out.gripper = gripper;
  out.stop = true;
  return out;
}

}  // namespace kr5::job
