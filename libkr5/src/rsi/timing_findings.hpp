// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "rsi/read_observations.hpp"

namespace kr5::rsi {

/// Cycle of the controller by what was observed; none of too few telegrams [s].
std::optional<double> measured_cycle(const ReadObservations& read);
/// Telegrams of the controller that were lost, damaged or overtaken, by the gaps of IPOC.
std::int64_t missing_telegrams(const ReadObservations& read);
/// Cycle, losses, jitter, interruptions, restarts, and clocks that were set.
Findings timing_findings(const ReadObservations& read);

}  // namespace kr5::rsi
