// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/arm_log/log_problem.hpp>

namespace kr5::arm_log {

/// Joint values beyond their limits, with the unit or side of the gears in which they would lie within.
std::vector<LogProblem> check_limits(const cell::Cell& cell, const cell::Experiment& experiment);
/// Measured joints that do not follow their own command.
std::vector<LogProblem> check_following(const cell::Cell& cell, const cell::Experiment& experiment);
/// The clock against the limits of speed and the cycle of the servo.
std::vector<LogProblem> check_clock(const cell::Cell& cell, const cell::Experiment& experiment);

}  // namespace kr5::arm_log
