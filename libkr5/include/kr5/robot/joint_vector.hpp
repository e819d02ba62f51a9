// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace kr5::robot {

/// Most joints of a robot that is read and commanded cycle by cycle.
inline constexpr int max_joints = 16;

/// One number a joint, in place: copying it allocates nothing.
using JointVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, max_joints, 1>;

/// @throws InvalidArgument for more than `max_joints` values.
JointVector joint_vector(const Eigen::Ref<const Eigen::VectorXd>& values);

}  // namespace kr5::robot
