// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>
#include <kr5/geometry/solid.hpp>

namespace kr5::physics {

/// Scanner in the flange, with the mount that the effect replaces.
/// @throws InvalidArgument naming what is not there.
Pose laser_mount(const cell::Cell& cell);

/// The line scanner of a cell with laser_mount, laser_bias and laser_lag: parallel rays along its Z.
class EffectiveScanner {
 public:
  /// @throws InvalidArgument naming what is not there.
  explicit EffectiveScanner(const cell::Cell& cell);

  const Pose& T_flange_scanner() const { return T_flange_scanner_; }
  /// Range that the scanner shows of a true one: laser_bias, none at its stand-off [m].
  double laser_bias(double range) const;
  /// Ray of the point x [m] of a profile, in the base, of a scanner that moves at `speed` [m/s] along its own Y:
  /// laser_lag, the profile was taken `speed` times the lag further back.
  Ray laser_lag(const Pose& T_base_scanner, double x, double speed) const;

 private:
  Pose T_flange_scanner_;
  double bias_, lag_, stand_off_, bias_distance_;
};

}  // namespace kr5::physics
