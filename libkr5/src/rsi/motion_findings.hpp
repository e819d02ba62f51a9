// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "rsi/read_observations.hpp"

namespace kr5::rsi {

/// Whether the arm moves as it is corrected. @param compared Set where it was corrected one component at a time.
Findings motion_findings(const ReadObservations& read, bool& compared);

}  // namespace kr5::rsi
