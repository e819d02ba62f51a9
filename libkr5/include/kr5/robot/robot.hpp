// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/robot/command.hpp>
#include <kr5/robot/reading.hpp>

namespace kr5::robot {

/// A robot, cycle by cycle: read it, step a controller, send what the controller gives. A simulated cell, a loopback
/// and the driver of a real controller are robots; controllers know none of them, only readings and commands.
class Robot {
 public:
  virtual ~Robot() = default;
  /// The reading of this cycle; a robot with a clock of its own waits for it.
  virtual RobotReading read() = 0;
  /// The command of this cycle, which ends it.
  virtual void send(const RobotCommand& command) = 0;
  /// Time between two readings [s].
  virtual double cycle() const = 0;
};

}  // namespace kr5::robot
