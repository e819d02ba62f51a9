// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include <kr5/calibration/arm_axes.hpp>
#include <kr5/kinematics/axis_chain.hpp>

/// @file
/// Private: the arm that has identified axes, and what their covariances say of its parameters.

namespace kr5::calibration {

/// The arm whose last frame has its origin at `end` and its z axis along the last axis.
kinematics::DhChain arm_of_lines(std::span<const kinematics::AxisLine> lines, const Eigen::VectorXd& home,
                                 const Eigen::Vector3d& end, double parallel = kinematics::near_parallel_sine);

/// As ArmAxesResult has them.
struct ArmParameterEstimate {
  std::vector<ArmParameter> parameters;
  Eigen::MatrixXd covariance;  ///< In their order.
};

/// The parameters that the axes determine, with covariances by propagation to first order.
ArmParameterEstimate estimate_arm_parameters(std::span<const JointAxisResult> axes, const kinematics::DhChain& arm,
                                             const Eigen::VectorXd& home, const Eigen::Vector3d& end);

}  // namespace kr5::calibration
