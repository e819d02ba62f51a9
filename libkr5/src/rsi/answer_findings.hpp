// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "rsi/read_observations.hpp"

namespace kr5::rsi {

/// Whether answers are in time, of the right form, and accepted.
Findings answer_findings(const ReadObservations& read);

}  // namespace kr5::rsi
