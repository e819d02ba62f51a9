// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/physics/row_range.hpp>

/// @file
/// Uninterrupted runs of a log, which is given by the first row of each.

namespace kr5::identification {

/// Runs of `rows` rows from their first rows; without any: one run.
std::vector<physics::RowRange> runs_of(const std::vector<int>& run_starts, Eigen::Index rows);

/// @throws InvalidArgument unless the first rows rise from 0 and stay below `rows`.
void require_run_starts(const std::vector<int>& run_starts, Eigen::Index rows);

/// @throws InvalidArgument naming the row whose time is not later than the one before, within its run.
void require_rising_times(const Eigen::VectorXd& t, const std::vector<int>& run_starts);

}  // namespace kr5::identification
