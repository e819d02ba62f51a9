// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace kr5::sim {

/// Dry friction of joints over one step: either it holds a joint still, or it has its full level against the motion.
/// @param response Speed each unit of friction takes away in the step, n x n, symmetric positive definite.
/// @param free Speeds at the end of the step without friction.
/// @returns friction f with |f| <= level: what speeds free - response f leaves is 0, or along f.
Eigen::VectorXd hold_or_slide(const Eigen::MatrixXd& response, const Eigen::VectorXd& free,
                              const Eigen::VectorXd& level);

}  // namespace kr5::sim
