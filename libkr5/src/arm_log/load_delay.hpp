// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/cell/recording.hpp>
#include <kr5/identification/dynamics.hpp>

namespace kr5::arm_log {

/// The best rigid arm with friction for the torques of motions.
struct BestArm {
  Eigen::MatrixXd left;  ///< What it leaves, rows x joints; empty where the motions determine no such arm [N m or N].
  double delay = 0.0;    ///< By which the torques were clearly logged late, and at which the arm was fitted [s].
  identification::DynamicsResult found = {};
};

/// The best arm for motions on measured positions, at the delay of the greatest likelihood where this is far above that
/// of none. @param live Joints (from 0) whose torques were measured: they tell the delay.
BestArm best_arm_with_delay(const cell::Cell& cell, const std::vector<cell::Experiment>& motions,
                            const std::vector<int>& live);

}  // namespace kr5::arm_log
