// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/robot/cycle.hpp>

namespace kr5::rsi {

/// The only cycle of a KR C2 [s].
inline constexpr double krc2_cycle = robot::usual_cycle;
/// The shorter one of the others, which they have unless they are told otherwise [s].
inline constexpr double short_cycle = 0.004;

}  // namespace kr5::rsi
