// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/identification/log_conditioning.hpp>
#include <kr5/physics/row_range.hpp>

namespace kr5::identification {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using physics::RowRange;

/// Rows of a log in the order of time, without those that lack a number.
struct OrderedLog {
  JointLog log;
  double step = 0.0;         ///< Median [s].
  std::vector<char> faulty;  ///< Rows in spans that may be left out.

  Index rows() const { return log.t.size(); }
  bool slide(Index joint, const ConditioningOptions& options) const;
};

/// What was found, and the rows that are left.
struct LogScan {
  OrderedLog ordered;
  std::vector<LogFinding> findings;
};

/// Checks a log from its clock to its torques.
LogScan scan_log(const JointLog& log, const ConditioningOptions& options);

/// A finding over rows `first` to `last` of a log.
LogFinding finding_at(const OrderedLog& data, LogFault fault, LogSeverity severity, const std::string& column,
                      Index joint, Index first, Index last);

/// Step of time above which a run ends [s].
double longest_step(const OrderedLog& data, const ConditioningOptions& options);

/// Runs of at least `least` rows, which end where a step of time exceeds `longest_step` [s] and at faulty rows.
std::vector<RowRange> log_runs(const OrderedLog& data, double longest_step, Index least);

/// Smoothed signals, run by run, as the checks of dynamics read them.
struct SmoothedLog {
  double cutoff = 0.0;       ///< [Hz]
  MatrixXd q, qd, qdd, tau;  ///< A row for each row of the log; zero outside of runs.
  std::vector<int> run;      ///< Of each row, from 0; -1 outside of runs.
  RowRange longest;

  /// Whether a row and those `margin` before and after it belong to one run.
  bool inside(Index row, Index margin) const;
};

/// Positions against limits, speeds against positions, joints that stand.
void check_positions(const OrderedLog& data, const ConditioningOptions& options, std::vector<LogFinding>& out);
void check_speeds(const OrderedLog& data, const SmoothedLog& smooth, const ConditioningOptions& options,
                  std::vector<LogFinding>& out);
/// Saturated and frozen channels; their rows become faulty.
void check_flat_channels(OrderedLog& data, std::vector<LogFinding>& out);
/// Torques against the motion: delay, sign, brakes, size.
void check_torques(OrderedLog& data, const SmoothedLog& smooth, const ConditioningOptions& options,
                   std::vector<LogFinding>& out);

}  // namespace kr5::identification
