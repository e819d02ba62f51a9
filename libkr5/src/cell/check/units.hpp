// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>

#include "cell/check/diagnostic_collector.hpp"

namespace kr5::cell {

/// Values that look like another unit. Form must have been checked.
void check_units(const Cell& cell, const io::Node& root, DiagnosticCollector& diagnostics);

}  // namespace kr5::cell
