// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "rsi/read_observations.hpp"

namespace kr5::rsi {

/// Whether telegrams have the Type and the elements of the layout, in its order.
Findings content_findings(const ReadObservations& read);

}  // namespace kr5::rsi
