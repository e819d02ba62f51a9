// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace kr5::robot {

/// The inverse of a servo x'' = w^2 (u - x) - 2 zeta w x': by how much its command u must be ahead of the path x.
struct ServoFeedforward {
  double of_speed = 0.0;         ///< 2 zeta / w [s]
  double of_acceleration = 0.0;  ///< 1 / w^2 [s^2]

  /// @param frequency w [rad/s]; 0: a servo that follows at once. @param damping zeta [-].
  constexpr ServoFeedforward(double frequency, double damping) noexcept {
    if (!(frequency > 0.0)) return;
    of_speed = 2 * damping / frequency;
    of_acceleration = 1 / (frequency * frequency);
  }
  /// u - x for a speed and an acceleration, numbers or vectors.
  template <class Value>
  Value operator()(const Value& speed, const Value& acceleration) const noexcept {
    return of_speed * speed + of_acceleration * acceleration;
  }
};

}  // namespace kr5::robot
