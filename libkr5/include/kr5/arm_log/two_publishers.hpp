// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace kr5::arm_log {

/// Whether positions, in the order of a log, jump to and fro, as those of two publishers, or two robots, do that write
/// to one place in turn, also at different rates. Noise, a flickering last digit and single spikes are no turns; of
/// fewer than twenty readings nothing is said. @param positions Of one joint [rad, m, or a unit of the log]; NaN where
/// there is none.
bool written_in_turn(const Eigen::VectorXd& positions);

}  // namespace kr5::arm_log
