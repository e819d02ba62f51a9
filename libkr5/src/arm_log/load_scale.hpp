// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/arm_log/log_problem.hpp>

/// @file
/// Loads against their simulation: a factor, a sign, an exchange, or no likeness at all.

namespace kr5::arm_log {

/// Recorded and simulated loads of one channel, rows x columns.
struct ComparedLoads {
  std::vector<cell::Column> columns;
  Eigen::MatrixXd measured, simulated;

  std::vector<std::string> names() const;
};

/// Of each recorded column (row) with each simulated one, each about its mean.
Eigen::MatrixXd load_correlations(const Eigen::MatrixXd& measured, const Eigen::MatrixXd& simulated);

/// Whether enough columns are like their simulation to be recognised.
bool are_recognised(const ComparedLoads& loads);

/// A factor that all columns share, as a wrong unit, sign or side of the gears gives. @param by_joint Whether a factor
/// of its own for each joint is objected to.
std::optional<LogProblem> check_scale(const cell::Cell& cell, const ComparedLoads& loads, bool by_joint);
/// Two columns each like the simulation of the other.
std::optional<LogProblem> check_exchange(const ComparedLoads& loads);
/// The column in which the simulation sees the largest load shows nothing of it.
std::optional<LogProblem> check_likeness(const ComparedLoads& loads);

}  // namespace kr5::arm_log
