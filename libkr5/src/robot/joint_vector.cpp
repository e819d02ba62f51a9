// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/robot/joint_vector.hpp>

#include <string>

#include <kr5/core/error.hpp>

namespace kr5::robot {

JointVector joint_vector(const Eigen::Ref<const Eigen::VectorXd>& values) {
  if (values.size() > max_joints)
    throw InvalidArgument("a robot has at most " + std::to_string(max_joints) + " joints, found " +
                          std::to_string(values.size()));
  return values;
}

}  // namespace kr5::robot
