// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/controller_axes.hpp>

#include <string>

#include <kr5/core/error.hpp>

namespace kr5::rsi {

void ControllerAxes::validate(int joints) const {
  const std::string expected = "expected " + std::to_string(joints) + " values, one a joint";
  require(sign.size() == joints, "axes.sign: " + expected);
  require(zero.size() == joints, "axes.zero: " + expected);
  require((sign.array().abs() == 1.0).all(), "axes.sign: must be 1 or -1 [-]");
  require(zero.allFinite(), "axes.zero: must be finite [rad or m]");
}

}  // namespace kr5::rsi
