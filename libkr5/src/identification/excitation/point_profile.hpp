// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/identification/excitation_motion.hpp>

namespace kr5::identification {

/// Part of its time for which a trapezoidal profile accelerates [-].
constexpr double profile_ramp = 0.25;

/// A way of length 1 that takes the time 1.
struct ProfileState {
  double place = 0.0, speed = 0.0, acceleration = 0.0;
};
/// At part u of the time; at rest at both ends and beyond.
ProfileState profile_state(ExcitationProfile profile, double u);

/// Greatest speed and acceleration of it.
constexpr double max_speed(ExcitationProfile profile) {
  return profile == ExcitationProfile::Quintic ? 1.875 : 1 / (1 - profile_ramp);
}
constexpr double max_acceleration(ExcitationProfile profile) {
  return profile == ExcitationProfile::Quintic ? 5.7735027 : 1 / (profile_ramp * (1 - profile_ramp));
}

}  // namespace kr5::identification
