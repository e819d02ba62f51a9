// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/hand_eye/model.hpp"

#include <kr5/geometry/pose_derivatives.hpp>

namespace kr5::calibration::hand_eye {

Pose predict(Mount mount, const Poses& poses, const Pose& T_base_flange) {
  const Pose T = mount == Mount::EyeInHand ? T_base_flange.inverse() : T_base_flange;
  return poses.X.inverse() * T * poses.Z;
}

Pose robot_pose(Mount mount, const Poses& poses, const Pose& M) {
  const Pose T = poses.Z * M.inverse() * poses.X.inverse();
  return mount == Mount::EyeInHand ? T : Pose(T.inverse());
}

Vector6 robot_residual(Mount mount, const Poses& poses, const Pose& T_base_flange, const Pose& M) {
  return pose_difference(T_base_flange, robot_pose(mount, poses, M));
}

RobotDerivatives robot_derivatives(Mount mount, const Poses& poses, const Pose& M, const Vector6& residual) {
  const Matrix6 G = vector_by_perturbation(residual);
  const Matrix6 seen_to_flange = adjoint(poses.X * M);
  if (mount == Mount::EyeInHand) return {-G * seen_to_flange, -G * adjoint(poses.X), G * seen_to_flange};
  return {G * adjoint(poses.Z), G * adjoint(poses.Z * M.inverse()), -G * adjoint(poses.Z)};
}

}  // namespace kr5::calibration::hand_eye
