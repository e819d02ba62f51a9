// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include <kr5/core/error.hpp>
#include <kr5/force/peg_on_tube.hpp>

namespace kr5::force {

/// In [0, 2 pi).
inline double wrapped(double azimuth) {
  const double out = std::fmod(azimuth, 2 * M_PI);
  return out < 0 ? out + 2 * M_PI : out;
}

/// @throws InvalidArgument for bodies that are not valid, or a tilt that is none.
inline void require_tilt(const PegTube& bodies, double tilt) {
  bodies.validate();
  require(tilt > 0 && tilt < M_PI_2, "tilt must lie between 0 and a quarter turn [rad]");
}

}  // namespace kr5::force
