// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/emulation_options.hpp>

#include <cmath>

#include <kr5/core/error.hpp>

namespace kr5::rsi {

void EmulationOptions::validate() const {
  rules.validate();
  require(path_speed > 0 && std::isfinite(path_speed), "path_speed: must be positive [rad/s]");
  require(override_share >= 0 && override_share <= 1, "override_share: must lie between 0 and 1 [-]");
  require(axis_speeds.size() == 0 || (axis_speeds.array() > 0).all(), "axis_speeds: must be positive [rad/s or m/s]");
}

}  // namespace kr5::rsi
