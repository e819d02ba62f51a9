// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>

/// @file
/// How large effects often are: where finite differences are taken, and what a prior calls plausible. Orders of
/// magnitude of industrial arms and of their data sheets; nothing depends on their digits.

namespace kr5::gap::sizes {

inline constexpr double angle = 1e-3;        ///< Zeros, twists, play, tilt [rad].
inline constexpr double length = 1e-3;       ///< Links and mounts [m].
inline constexpr double part = 0.2;          ///< Of a nominal value (bandwidth, friction, stiffness).
inline constexpr double scale = 0.05;        ///< Of a factor known from a data sheet (gain, torque constant).
inline constexpr double half_cycle = 0.006;  ///< Delays and lags [s].

/// Dry friction of a joint, the measure of all torques that disturb it [N m or N].
inline double friction(const cell::Cell& cell, int joint) {
  if (cell.drives && cell.drives->friction.coulomb(joint) > 0) return cell.drives->friction.coulomb(joint);
  return 5.0;
}

inline double viscous(const cell::Cell& cell, int joint) {
  if (cell.drives && cell.drives->friction.viscous(joint) > 0) return cell.drives->friction.viscous(joint);
  return friction(cell, joint);
}

/// Noise of a component of the wrench, or a usual one [N, N m].
inline double wrench_noise(const cell::Cell& cell, int component) {
  if (component < 3) return cell.noise.force > 0 ? cell.noise.force : 0.1;
  return cell.noise.torque > 0 ? cell.noise.torque : 0.01;
}

}  // namespace kr5::gap::sizes
