// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include <kr5/robot/robot.hpp>
#include <kr5/sim/driven_arm.hpp>

/// @file
/// The robot of a cell, whatever its task: the other end of a controller, cycle by cycle.

namespace kr5::sim {

struct CellRobotOptions {
  std::optional<double> cycle = {};  ///< [s]
  Eigen::VectorXd start;             ///< [rad or m]
  double braking = 5.0;              ///< [rad/s^2 or m/s^2]
  bool noise = true;
  std::uint64_t seed = 1;

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("cycle", self.cycle, "Time between two readings; none: the cycle of the cell's servo [s].");
    visit("start", self.start,
          "Joint values at the beginning; empty: the middle of the limits, or 0 where there are none [rad or m].");
    visit("braking", self.braking, "Deceleration of each joint by the brakes, on a stop [rad/s^2 or m/s^2].");
    visit("noise", self.noise, "Noise of the cell in the readings.");
    visit("seed", self.seed, "Random seed of the noise.");
  }
};

/// The arm of a cell with servos, gears, links, encoders and wrist sensor, with the effects of the cell. Commands of
/// joints go through the joint servos with their delay, commands of the tool through the servo of the path, where the
/// cell has one: behind it the joints are told ahead of time. A stop brakes. Readings are what sensors tell; where the
/// arm thinks it is follows from them and from the nominal cell. The gripper tells nothing and is believed.
class CellRobot : public robot::Robot {
 public:
  /// @throws InvalidArgument naming the missing part of the cell, or the option.
  explicit CellRobot(const cell::Cell& real, const CellRobotOptions& options = {});
  ~CellRobot() override;
  CellRobot(CellRobot&&) noexcept;
  CellRobot& operator=(CellRobot&&) noexcept;

  robot::RobotReading read() override;
  /// Moves for a cycle. A command that the arm cannot reach, or that lies beyond the limits, leaves it where it is.
  void send(const robot::RobotCommand& command) override;
  double cycle() const override;

  void set_environment(Environment environment);
  /// What really is, which no controller knows.
  const ArmReading& actual();
  const robot::GripperCommand& gripper() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kr5::sim
