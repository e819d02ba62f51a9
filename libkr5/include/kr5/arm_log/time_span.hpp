// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/core/fields.hpp>

namespace kr5::arm_log {

/// A span of time.
struct TimeSpan {
  double begin = 0.0;  ///< [s]
  double end = 0.0;    ///< [s]

  static void each_field(auto& self, auto&& visit) {
    visit("begin", self.begin, "Beginning [s].");
    visit("end", self.end, "End [s].");
  }
};

}  // namespace kr5::arm_log
