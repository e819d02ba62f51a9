// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/arm_log/log_problem.hpp>

namespace kr5::arm_log {

/// What speaks against logged commands as the positions that servos were told to reach: they are the measurements
/// themselves, speeds, or numbers of another unit, zero or body; a joint does not follow them, or no longer. Weak
/// servos follow with a fraction of the motion, and late.
std::vector<LogProblem> check_commands(const cell::Cell& cell, const cell::Experiment& experiment);

}  // namespace kr5::arm_log
