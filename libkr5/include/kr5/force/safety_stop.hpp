// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/robot/cycle.hpp>

/// @file
/// What stops the arm, and how much current it may take (Hayat et al. 2022, sections 5.2 and 6.1).

namespace kr5::force {

struct SafetyLimits {
  double force = 80.0;                ///< [N]
  double torque = 8.0;                ///< [N m]
  Eigen::VectorXd current;            ///< [A]
  double dead_after = 0.25;           ///< [s]
  double cycle = robot::usual_cycle;  ///< [s]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("force", self.force, "Maximum force [N].");
    visit("torque", self.torque, "Maximum torque [N m].");
    visit("current", self.current, "Maximum current of each motor; empty: not monitored [A].");
    visit("dead_after", self.dead_after,
          "Time after which a sensor with unchanged readings counts as dead; 0: never [s].");
    visit("cycle", self.cycle, "Time between two readings [s].");
  }
};

enum class Violation { None, Force, Torque, Current, SensorDead, SensorSaturated };
constexpr auto enum_names(Violation) {
  using enum Violation;
  return names<Violation>({{None, "none"},
                           {Force, "force"},
                           {Torque, "torque"},
                           {Current, "current"},
                           {SensorDead, "sensor_dead"},
                           {SensorSaturated, "sensor_saturated"}});
}

/// Watches every cycle; the first violation stays until reset(). Nothing here allocates or throws once it is made.
class SafetyStop {
 public:
  /// @throws InvalidArgument as its limits.
  explicit SafetyStop(const SafetyLimits& limits);

  /// @param raw Reading of the sensor. @param wrench Of the environment alone, unfiltered, so that no cycle is lost
  /// [N, N m]. @param current Of each motor; with limits set, as many as
  /// those, or it is a violation [A].
  Violation step(const Vector6& raw, const Vector6& wrench, std::span<const double> current, bool saturated) noexcept;
  Violation violation() const noexcept { return latched_; }
  void reset() noexcept;

 private:
  Violation find_violation(const Vector6& raw, const Vector6& wrench, std::span<const double> current,
                           bool saturated) noexcept;

  SafetyLimits limits_;
  Vector6 last_ = Vector6::Zero();
  int same_ = 0;
  Violation latched_ = Violation::None;
};

/// Currents that a slow arm needs, and how much more it may take: an obstructed joint then yields.
struct CurrentLimitOptions {
  double margin = 0.1;     ///< [-]
  double min_limit = 0.0;  ///< [A]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("margin", self.margin, "Margin above what the posture and its friction need [-].");
    visit("min_limit", self.min_limit, "Lower bound of every limit, so that a joint without load can move [A].");
  }
};

/// Limit of each motor [A]: margin times what holding the posture and sliding needs, either way.
/// @param gravity Current that holds the posture [A]. @param friction Half the width of the hysteresis, beta of (5.8)
/// [A]; both one a motor.
/// @throws InvalidArgument for unequal sizes, numbers that are not finite, negative friction.
Eigen::VectorXd current_limits(const Eigen::VectorXd& gravity, const Eigen::VectorXd& friction,
                               const CurrentLimitOptions& options = {});

}  // namespace kr5::force
