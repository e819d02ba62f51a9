// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/geometry/pose.hpp>

/// @file
/// Poses as KUKA writes them: X Y Z in mm, A B C in degrees with R = Rz(A) Ry(B) Rx(C). Only this module knows them.

namespace kr5::rsi {

/// @param xyzabc [mm, deg].
Pose from_kuka(const Vector6& xyzabc) noexcept;
/// X Y Z A B C [mm, deg]; A and C in (-180, 180], B in [-90, 90], at the poles C is 0.
Vector6 to_kuka(const Pose& T) noexcept;

}  // namespace kr5::rsi
