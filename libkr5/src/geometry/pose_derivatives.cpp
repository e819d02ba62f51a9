// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/geometry/pose_derivatives.hpp>

#include <cmath>

namespace kr5 {

Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& w) {
  const double angle = w.norm(), squared = angle * angle;
  const Eigen::Matrix3d W = skew(w);
  if (angle < 1e-4) return Eigen::Matrix3d::Identity() - 0.5 * W + W * W / 6.0;
  return Eigen::Matrix3d::Identity() - (1 - std::cos(angle)) / squared * W +
         (angle - std::sin(angle)) / (squared * angle) * W * W;
}

Eigen::Matrix3d right_jacobian_inverse(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  const Eigen::Matrix3d W = skew(w);
  double factor = 1.0 / 12.0;
  if (angle > 1e-4) factor = (1 - angle * std::cos(angle / 2) / (2 * std::sin(angle / 2))) / (angle * angle);
  return Eigen::Matrix3d::Identity() + 0.5 * W + factor * W * W;
}

Matrix6 vector_by_perturbation(const Vector6& v) {
  Matrix6 out = Matrix6::Zero();
  out.topLeftCorner<3, 3>() = exp_rotation(v.tail<3>());
  out.bottomRightCorner<3, 3>() = right_jacobian_inverse(v.tail<3>());
  return out;
}

}  // namespace kr5
