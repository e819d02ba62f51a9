// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include <kr5/arm_log/log_problem.hpp>

namespace kr5::arm_log {

/// Loads that are the same in every row, as of a driver that does not measure them.
std::optional<LogProblem> check_constant(const cell::Cell& cell, const cell::Experiment& experiment);
/// Loads that are those of another joint.
std::vector<LogProblem> check_copies(const cell::Cell& cell, const cell::Experiment& experiment);
/// Loads without their sign, or with negative ones as large numbers.
std::optional<LogProblem> check_signs(const cell::Cell& cell, const cell::Experiment& experiment);
/// Loads that are clipped, in which nothing but the limit is seen.
std::vector<LogProblem> check_saturated(const cell::Cell& cell, const cell::Experiment& experiment);
/// Loads from which the controller took those of gravity: they are like the simulation of an arm without weight.
std::optional<LogProblem> check_weight(const cell::Cell& cell, const cell::Experiment& experiment);
/// Joints in another order than the model's, or counted another way, which shows in many ways that say less.
std::optional<LogProblem> check_reading(const cell::Cell& cell, const cell::Experiment& experiment);

}  // namespace kr5::arm_log
