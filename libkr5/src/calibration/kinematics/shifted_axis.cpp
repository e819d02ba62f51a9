// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/kinematics/shifted_axis.hpp"

#include <cmath>

namespace kr5::calibration {

kinematics::AxisLine shifted_axis(const JointAxisResult& axis, const Eigen::Vector4d& d) {
  const Eigen::Matrix3d& R = axis.T_world_axis.linear();
  const double height = R.col(2).dot(axis.axis.point - axis.T_world_axis.translation());
  const Eigen::Vector3d tilt(d[3], -d[2], 0.0);
  return {axis.axis.point + R * (Eigen::Vector3d(d[0], d[1], 0.0) + height * tilt),
          (axis.axis.direction + R * tilt).normalized()};
}

double offset_std(const JointAxisResult& axis) { return std::sqrt(axis.covariance.topLeftCorner<2, 2>().trace()); }

double tilt_std(const JointAxisResult& axis) { return std::sqrt(axis.covariance.bottomRightCorner<2, 2>().trace()); }

}  // namespace kr5::calibration
