// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <optional>

#include <kr5/robot/command.hpp>
#include <kr5/robot/reading.hpp>
#include <kr5/rsi/telegram_layout.hpp>

namespace kr5::rsi {

struct TestMotionOptions {
  double angle = 0.0017453292519943296;  ///< [rad]
  double translation = 0.0005;           ///< [m]
  double duration = 0.8;                 ///< [s]
  double rest = 0.6;                     ///< [s]
  double abort_ratio = 3.0;              ///< [-]

  /// @throws InvalidArgument naming the field.
  void validate() const;
  /// Until all components were moved [s].
  double total() const noexcept { return 6 * (rest + duration); }

  static void each_field(auto& self, auto&& visit) {
    visit("angle", self.angle, "Greatest rotation of an axis or of the tool, at most 1 degree [rad].");
    visit("translation", self.translation, "Greatest translation of the tool, at most 5 mm [m].");
    visit("duration", self.duration, "Time of one motion, there and back [s].");
    visit("rest", self.rest, "Rest between two motions [s].");
    visit("abort_ratio", self.abort_ratio, "Motion over the one wanted at which the test is given up [-].");
  }
};

/// A small motion of each axis, or of the tool along and about each axis where the layout corrects no axes, one after
/// the other, there and back. It is given up, and what was moved is taken back, once anything moves farther than
/// wanted; after an interruption nothing moves any more. One thread steps it, which allocates and throws nothing.
class TestMotion {
 public:
  /// @throws InvalidArgument as layout and options, or for a layout without corrections.
  TestMotion(const TelegramLayout& layout, robot::CommandFrame frame, const TestMotionOptions& options);

  robot::RobotCommand step(const robot::RobotReading& reading) noexcept;
  /// It was given up.
  bool aborted() const noexcept { return aborted_.load(); }

 private:
  /// Where a component should be after some time [rad or m].
  double demand(double time, int& component) const noexcept;
  double size_of(int component) const noexcept { return is_angle(component) ? options_.angle : options_.translation; }
  bool is_angle(int component) const noexcept { return joints_ || component >= 3; }
  bool moved_too_far(const robot::RobotReading& reading) const noexcept;
  robot::RobotCommand command(int component, double way) const noexcept;

  bool joints_ = true;
  robot::CommandFrame frame_;
  TestMotionOptions options_;
  std::optional<robot::RobotReading> first_ = {};
  double last_time_ = 0.0, abort_time_ = 0.0;
  double abort_value_ = 0.0, value_ = 0.0;
  int component_ = 0;
  bool over_ = false;
  std::atomic<bool> aborted_{false};
};

}  // namespace kr5::rsi
