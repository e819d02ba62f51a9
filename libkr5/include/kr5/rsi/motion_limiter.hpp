// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/core/fields.hpp>

namespace kr5::rsi {

/// Limits of one coordinate of a correction: an axis, or a component of a translation or rotation vector.
struct MotionLimits {
  double speed = 0.1;         ///< [rad/s or m/s]
  double acceleration = 1.0;  ///< [rad/s^2 or m/s^2]
  double total = 0.005;       ///< [rad or m]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("speed", self.speed, "Maximum speed, either way [rad/s or m/s].");
    visit("acceleration", self.acceleration, "Maximum change of the speed, also when it stops [rad/s^2 or m/s^2].");
    visit("total", self.total, "Maximum of the whole correction, either way [rad or m].");
  }
};

/// One coordinate that never leaves its limits, whatever is demanded: in every cycle its speed changes by no more than
/// the acceleration, and it can always stop before its total. Demands within the limits are followed exactly; behind a
/// jump it arrives without going beyond. A demand that is no finite number stops it. Allocates and throws nothing.
class MotionLimiter {
 public:
  /// @param cycle [s]. @throws InvalidArgument.
  MotionLimiter(const MotionLimits& limits, double cycle);

  /// A cycle towards a value.
  double follow(double demand) noexcept;
  /// A cycle that goes some way from where it is.
  double move(double way) noexcept;
  /// A cycle of slowing down.
  double brake() noexcept;
  /// Stands at a value, or at the total that is nearest to it.
  void stand(double value) noexcept;
  /// Counts from where it is, at the speed that it has. @param demand The last one, from there.
  void recount(double demand) noexcept;

  double value() const noexcept { return value_; }
  double speed() const noexcept { return speed_; }

 private:
  double to_speed(double wanted) noexcept;
  /// Greatest speed in a cycle after which it still stops within a distance.
  double stoppable(double distance) const noexcept;

  double cycle_, total_, most_speed_, most_change_;
  double value_ = 0.0, speed_ = 0.0, demand_ = 0.0;
};

}  // namespace kr5::rsi
