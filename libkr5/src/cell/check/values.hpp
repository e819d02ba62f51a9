// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>

#include "cell/check/diagnostic_collector.hpp"

namespace kr5::cell {

/// Values that no real cell has: masses, inertias, limits, drives, effects out of bounds. Form must have been checked.
void check_values(const Cell& cell, DiagnosticCollector& diagnostics);

}  // namespace kr5::cell
