// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// Giving way to forces and moments: lateral and orientation force control (Hayat et al. 2022, section 6.4). Speeds,
/// not positions, so that there is no steady error. Nothing here allocates or throws.

namespace kr5::force {

struct ComplianceOptions {
  double gain = 2e-4;              ///< [m/(s N)]
  double turning_gain = 0.015;     ///< [rad/(s N m)]
  double max_speed = 0.01;         ///< [m/s]
  double max_turning_speed = 0.2;  ///< [rad/s]

  /// Whether an integrating loop with this gain, a contact and a grip of these stiffnesses and a delay comes to rest
  /// with a gain margin of at least 1.57: gain x stiffness x delay <= 1 (an integrator behind a delay, limit pi / 2).
  bool stable(double stiffness, double turning_stiffness, double delay) const;
  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("gain", self.gain, "Speed per error of force [m/(s N)].");
    visit("turning_gain", self.turning_gain, "Turning speed per error of moment [rad/(s N m)].");
    visit("max_speed", self.max_speed, "Maximum speed [m/s].");
    visit("max_turning_speed", self.max_turning_speed, "Maximum turning speed [rad/s].");
  }
};

/// Twist with which a tool yields to a wrench, away from a reference wrench: linear part first [m/s, rad/s]; zero when
/// a number is not finite.
/// @param wrench What the environment does to the tool. @param reference What it shall do; in the same frame [N, N m].
Vector6 admittance_twist(const Vector6& wrench, const Vector6& reference, const ComplianceOptions& options) noexcept;

}  // namespace kr5::force
