// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/calibration/hand_eye.hpp>
#include <kr5/geometry/resection.hpp>

/// @file
/// Private: the geometry of one hand-eye view, and what it says to first order. Both mounts become
///   T_i * X * M_i = Z,  X = T_mount_camera, Z = T_fixed_target, M_i = T_camera_target,
/// with T_i = T_base_flange (in hand) or its inverse (to hand).

namespace kr5::calibration::hand_eye {

/// The two unknown poses.
struct Poses {
  Pose X = Pose::Identity();  ///< T_mount_camera
  Pose Z = Pose::Identity();  ///< T_fixed_target
};

/// T_camera_target that the poses imply when the flange is at T_base_flange.
Pose predict(Mount mount, const Poses& poses, const Pose& T_base_flange);
/// T_base_flange at which the camera would see the target at M.
Pose robot_pose(Mount mount, const Poses& poses, const Pose& M);

/// How the robot pose misses what the camera says, with the target seen at M: right perturbation of T_base_flange
/// [m, rad].
Vector6 robot_residual(Mount mount, const Poses& poses, const Pose& T_base_flange, const Pose& M);
/// How it changes with right perturbations of M, X and Z, first order.
struct RobotDerivatives {
  Matrix6 by_target_seen, by_x, by_z;
};
RobotDerivatives robot_derivatives(Mount mount, const Poses& poses, const Pose& M, const Vector6& residual);

/// One view with what does not change during the fit.
struct ObservedView {
  const HandEyeView* input = nullptr;
  std::vector<Resection> found;  ///< One or two poses of the target; empty when there is none.
  int chosen = 0;                ///< Which of them the fit believes.

  const Resection& pose() const { return found[static_cast<std::size_t>(chosen)]; }
};

/// y = F [x z] + e + n: what the pixels of one view say about the error e of its robot pose (right perturbation of
/// the reported one [m, rad]), to first order in the perturbations x of X and z of Z.
/// Var e = diag(sigma_position^2, sigma_rotation^2), Var n = sigma_pixel^2 U, U widened by the view's `correlation`.
struct LinearView {
  Vector6 y;
  Eigen::Matrix<double, 6, 12> F;
  Matrix6 U;
  double pixel_squares = 0.0;  ///< Weighted squares that no pose of the target explains [px^2].
  double pixel_dof = 0.0;      ///< Their degrees of freedom.
};

}  // namespace kr5::calibration::hand_eye
