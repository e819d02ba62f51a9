// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <numbers>

namespace kr5::rsi {

inline constexpr double degree = std::numbers::pi / 180.0;  ///< [rad]
inline constexpr double millimetre = 1e-3;                  ///< [m]

}  // namespace kr5::rsi
