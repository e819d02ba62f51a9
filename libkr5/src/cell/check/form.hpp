// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>

#include "cell/check/diagnostic_collector.hpp"

namespace kr5::cell {

/// Sizes that do not fit and parts that contradict each other: such a cell cannot be computed with.
void check_form(const Cell& cell, DiagnosticCollector& diagnostics);

}  // namespace kr5::cell
