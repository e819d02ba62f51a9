// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/arm_log/arm_log.hpp>
#include <kr5/arm_log/log_note.hpp>
#include <kr5/arm_log/log_problem.hpp>
#include <kr5/arm_log/reading_noise.hpp>
#include <kr5/cell/recording.hpp>

namespace kr5::arm_log {

/// A log as a recording.
struct LogRecording {
  cell::Recording recording;
  Readings readings;                 ///< Loads before long experiments were thinned, for their noise.
  std::vector<LogNote> notes;        ///< What was done to the numbers.
  std::vector<LogProblem> problems;  ///< What speaks against them, where it was trusted nevertheless.
};

/// Time after which the servos of a cell have forgotten how a motion that starts at q [rad or m] began; 0 without
/// servos of the joints [s].
double settle_time(const cell::Cell& cell, const Eigen::VectorXd& q);

/// @throws InvalidArgument for a model without masses of its links, from which torques follow.
void require_masses(const cell::Cell& model);

/// The experiments of a log: commands where the cell has a servo that follows them, else measured positions, smoothed;
/// the last part of the motion to check. Efforts, or else currents, are the loads; an arm with torque servos needs
/// none.
/// @throws InvalidArgument as ArmLog::validate; naming what a diagnosis lacks: a motion, masses of the links, rows.
LogRecording record_log(const ArmLog& log, const cell::Cell& cell);

}  // namespace kr5::arm_log
