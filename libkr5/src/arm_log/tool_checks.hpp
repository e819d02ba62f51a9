// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/arm_log/log_problem.hpp>

namespace kr5::arm_log {

/// Measured positions of the tool against where the cell puts it: another unit, or measured in another frame.
std::vector<LogProblem> check_tool(const cell::Cell& cell, const cell::Experiment& experiment);

}  // namespace kr5::arm_log
