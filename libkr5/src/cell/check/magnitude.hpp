// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>

#include "cell/check/diagnostic_collector.hpp"

namespace kr5::cell {

/// Numbers of any field that are not finite, or beyond what its unit allows in a robot cell: they cannot be simulated.
void check_magnitude(const Cell& cell, DiagnosticCollector& diagnostics);

}  // namespace kr5::cell
