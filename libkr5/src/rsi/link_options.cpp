// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/link_options.hpp>

#include <cmath>

#include <kr5/core/error.hpp>

namespace kr5::rsi {

void LinkOptions::validate() const {
  require(cycle >= 0.001 && cycle <= 0.1, "cycle: must lie between 1 and 100 ms [s]");
  require(!deadline || (*deadline > 0 && *deadline <= cycle), "deadline: must be positive and within the cycle [s]");
  require(silence >= 2 * cycle && silence <= 60, "silence: must lie between two cycles and a minute [s]");
  limits.validate();
  real_time.validate();
}

double LinkOptions::deadline_or_usual() const noexcept { return deadline.value_or(cycle * 10 / 12); }

}  // namespace kr5::rsi
