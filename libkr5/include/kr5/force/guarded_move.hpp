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
  double touch = 3.0;          ///< [N]
  double most = 20.0;          ///< [N]
  double stiffness = 23.38e3;  ///< [N/m]
  double delay = 0.1;          ///< [s]

  /// The fastest contact after which the force is no more than `most` when the arm stops at the touch: what the contact
  /// is driven in while the touch is being noticed and while it brakes [m/s].
  double safe_speed() const;
  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("speed", self.speed, "Where nothing can be touched yet [m/s].");
    visit("contact_speed", self.contact_speed, "Where it can; 0: the safe speed. Faster ones are cut to it [m/s].");
    visit("acceleration", self.acceleration, "With which the arm brakes [m/s^2].");
    visit("touch", self.touch, "From which it is a touch [N].");
    visit("most", self.most, "That the contact may bear [N].");
    visit("stiffness", self.stiffness, "Of the contact [N/m].");
    visit("delay", self.delay, "From a force to the arm's answer, filter and servo in it [s].");
  }
};

class GuardedMove {
 public:
  /// @throws InvalidArgument as its options.
  explicit GuardedMove(const GuardedMoveOptions& options);

  /// Speed of this cycle, 0 from the touch on [m/s].
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
