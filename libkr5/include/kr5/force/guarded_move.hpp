// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/core/fields.hpp>

/// @file
/// Moving until something is touched, no faster than the loop can stop (Hayat et al. 2022, section 5.4). Cycle by
/// cycle; nothing here allocates or throws once it is made.

namespace kr5::force {

struct GuardedMoveOptions {
  double speed = 0.04;         ///< [m/s]
  double contact_speed = 0.0;  ///< [m/s]
  double acceleration = 0.15;  ///< [m/s^2]
  double touch_force = 3.0;    ///< [N]
  double max_force = 20.0;     ///< [N]
  double stiffness = 23.38e3;  ///< [N/m]
  double delay = 0.1;          ///< [s]

  /// The fastest contact after which the force is no more than `most` when the arm stops at the touch: what the contact
  /// is driven in while the touch is being detected and while it brakes [m/s].
  double safe_speed() const;
  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("speed", self.speed, "Speed where no contact is possible yet [m/s].");
    visit("contact_speed", self.contact_speed,
          "Speed where contact is possible; 0: the safe speed, which is also its upper limit [m/s].");
    visit("acceleration", self.acceleration, "Braking acceleration of the arm [m/s^2].");
    visit("touch_force", self.touch_force, "Force from which contact is detected [N].");
    visit("max_force", self.max_force, "Maximum force on the contact [N].");
    visit("stiffness", self.stiffness, "Stiffness of the contact [N/m].");
    visit("delay", self.delay, "Delay from a force to the response of the arm, with filter and servo [s].");
  }
};

class GuardedMove {
 public:
  /// @throws InvalidArgument as its options.
  explicit GuardedMove(const GuardedMoveOptions& options);

  /// Speed of this cycle [m/s]; 0 from the touch on, and from an argument that is no finite number on.
  /// @param way Left until something can be touched; below 0 it may be anywhere [m]. @param force Against the move [N].
  double step(double way, double force) noexcept;
  bool touched() const noexcept { return touched_; }
  void reset() noexcept { touched_ = false; }

 private:
  GuardedMoveOptions options_;
  double slow_ = 0.0;
  bool touched_ = false;
};

}  // namespace kr5::force
