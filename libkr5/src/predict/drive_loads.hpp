// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>

#include "predict/second_order.hpp"

/// @file
/// From what the joints carry to what the motors draw.

namespace kr5::predict {

/// Torque that the drives give on the joint side, N x n [N m or N]: what the links and the dress pack ask (`load`), and
/// what friction and ripple add.
Eigen::MatrixXd drive_torques(const cell::Cell& cell, const Eigen::VectorXd& t, const Response& servo,
                              const Eigen::MatrixXd& load);

/// Logged motor currents for these torques, N x n [A]. Needs drives.
Eigen::MatrixXd currents(const cell::Cell& cell, const Eigen::VectorXd& t, const Response& servo,
                         const Eigen::MatrixXd& torque);

}  // namespace kr5::predict
