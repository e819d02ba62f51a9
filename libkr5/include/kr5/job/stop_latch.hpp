// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <optional>

#include <kr5/force/safety_stop.hpp>
#include <kr5/robot/command.hpp>
#include <kr5/robot/reading.hpp>

/// @file
/// The stop of a job: what trips it, and how the arm is held (Hayat et al. 2022, section 6.1).

namespace kr5::job {

/// What stopped the arm.
enum class StopReason {
  None,
  Force,
  Torque,
  Current,
  SensorDead,
  SensorSaturated,
  Speed,
  Workspace,
  TimeOut,
  LostLink,
  Operator,
  Journal,      ///< What happens cannot be written down.
  Obstructed,   ///< Something was met where nothing should be.
  Unreachable,  ///< The arm cannot go where it is sent.
  Robot,        ///< The robot stands by itself.
  CellFault,    ///< The cell is not as it is believed.
  Exhausted,    ///< No retry is left.
};
constexpr auto enum_names(StopReason) {
  using enum StopReason;
  return names<StopReason>({{None, "none"},
                            {Force, "force"},
                            {Torque, "torque"},
                            {Current, "current"},
                            {SensorDead, "sensor_dead"},
                            {SensorSaturated, "sensor_saturated"},
                            {Speed, "speed"},
                            {Workspace, "workspace"},
                            {TimeOut, "time_out"},
                            {LostLink, "lost_link"},
                            {Operator, "operator"},
                            {Journal, "journal"},
                            {Obstructed, "obstructed"},
                            {Unreachable, "unreachable"},
                            {Robot, "robot"},
                            {CellFault, "cell_fault"},
                            {Exhausted, "exhausted"}});
}

struct StopLimits {
  force::SafetyLimits sensor;
  double speed = 1.0;                                      ///< [m/s]
  double turning_speed = 6.0;                              ///< [rad/s]
  Eigen::Vector3d lowest = Eigen::Vector3d::Constant(-2);  ///< [m]
  Eigen::Vector3d highest = Eigen::Vector3d::Constant(2);  ///< [m]
  double silence = 0.1;                                    ///< [s]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("sensor", self.sensor, "Limits of force, torque and current.");
    visit("speed", self.speed, "Maximum speed of the tool tip, as it is measured [m/s].");
    visit("turning_speed", self.turning_speed, "Maximum turning speed of the tool, as it is measured [rad/s].");
    visit("lowest", self.lowest, "Corner of the workspace of the tool tip, in B [m].");
    visit("highest", self.highest, "Opposite corner of it [m].");
    visit("silence", self.silence, "Time between two readings after which the link counts as lost [s].");
  }
};

/// Watches every reading. What trips it first stays, and the arm is held where it was measured then; only a new latch,
/// made when a person has released the stop, lets it move. `step` is of one thread; `stop_by_operator` and
/// `note_lost_link` are of any. Nothing here allocates or throws once it is made.
class StopLatch {
 public:
  /// @param standing A stop that nobody has released yet. @throws InvalidArgument as its limits.
  explicit StopLatch(const StopLimits& limits, StopReason standing = StopReason::None);

  /// @param force Limit of this cycle beside that of the limits; 0: none [N].
  StopReason step(const robot::RobotReading& reading, double force = 0.0) noexcept;
  /// Latches for a reason that is not in the readings, at the pose of the last one.
  void trip(StopReason reason) noexcept;
  void stop_by_operator() noexcept { asked_.store(StopReason::Operator, std::memory_order_release); }
  void note_lost_link() noexcept { asked_.store(StopReason::LostLink, std::memory_order_release); }

  StopReason reason() const noexcept { return reason_; }
  bool latched() const noexcept { return reason_ != StopReason::None; }
  /// Holds the arm where it was measured when the stop latched, and the gripper as it is.
  robot::RobotCommand hold(const robot::GripperCommand& gripper) const noexcept;

 private:
  StopReason find_reason(const robot::RobotReading& reading, double force) noexcept;
  bool too_fast(const robot::RobotReading& reading) const noexcept;

  StopLimits limits_;
  force::SafetyStop sensor_;
  std::atomic<StopReason> asked_ = StopReason::None;
  StopReason reason_ = StopReason::None;
  bool begun_ = false;
  double last_time_ = 0.0;
  Pose last_ = Pose::Identity();  ///< The last pose of finite numbers.
  std::optional<Pose> held_;
};

}  // namespace kr5::job
