// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "rsi/read_observations.hpp"

namespace kr5::rsi {

/// Whether anything comes, to the right socket, from one sender, undamaged.
Findings arrival_findings(const ReadObservations& read);

}  // namespace kr5::rsi
