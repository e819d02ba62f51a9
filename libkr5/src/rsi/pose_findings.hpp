// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "rsi/read_observations.hpp"

namespace kr5::rsi {

/// Whether axis values and pose agree with the model, where there is one. @param compared Set where they could be.
Findings pose_findings(const ReadObservations& read, bool& compared);

}  // namespace kr5::rsi
