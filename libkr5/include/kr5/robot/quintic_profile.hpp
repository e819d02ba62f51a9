// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace kr5::robot {

/// The share of a way that was gone at a share s of its time, and its derivatives by s: the polynomial whose speed and
/// acceleration begin and end at zero.
struct QuinticProfile {
  double x = 0.0, v = 0.0, a = 0.0;
};
inline constexpr QuinticProfile quintic_profile_peak = {1.0, 1.875, 5.7735};  // the greatest of each

constexpr QuinticProfile quintic_profile(double s) noexcept {
  if (s <= 0.0) return {};
  if (s >= 1.0) return {1.0, 0.0, 0.0};
  return {s * s * s * (10 + s * (6 * s - 15)), 30 * s * s * (1 - s) * (1 - s), 60 * s * (1 - s) * (1 - 2 * s)};
}

}  // namespace kr5::robot
