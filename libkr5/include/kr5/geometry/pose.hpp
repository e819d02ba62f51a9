// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include <Eigen/Geometry>

/// @file
/// Poses. `T_a_b` is the pose of frame b in frame a: p_a = T_a_b * p_b. Six-vectors are linear first.

namespace kr5 {

using Pose = Eigen::Isometry3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;  ///< [x y z, rx ry rz] in metres, then radians.
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Cross-product matrix: skew(a) * b = a x b.
Eigen::Matrix3d skew(const Eigen::Vector3d& v);

/// Rotation by the vector w [rad]; exact for any angle.
Eigen::Matrix3d exp_rotation(const Eigen::Vector3d& w);
/// Rotation vector of R [rad], angle in [0, pi]; accurate near 0 and near pi.
Eigen::Vector3d log_rotation(const Eigen::Matrix3d& R);

/// Pose from a six-vector whose translation and rotation vector are taken separately (not the screw exponential):
/// a right perturbation of T by d is T * to_pose(d).
Pose to_pose(const Vector6& d);
/// Inverse of `to_pose`: [translation, rotation vector].
Vector6 to_vector(const Pose& T);
/// Difference as a right perturbation: T_b = T_a * to_pose(pose_difference(T_a, T_b)) [m, rad].
Vector6 pose_difference(const Pose& T_a, const Pose& T_b);
/// Moves a right perturbation across a pose, first order: T * to_pose(d) = to_pose(adjoint(T) * d) * T.
Matrix6 adjoint(const Pose& T);

/// `x y z roll pitch yaw` with R = Rz(yaw) Ry(pitch) Rx(roll) [m, rad], as in cell files.
Pose from_xyzrpy(const Vector6& v);
/// Inverse of `from_xyzrpy`; pitch in [-pi/2, pi/2], at the poles roll is 0.
Vector6 to_xyzrpy(const Pose& T);

/// Rotation in the sense of least squares nearest to M; always proper (determinant +1).
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& M);
/// The shortest rotation that turns Z into a direction, which needs no unit length.
Eigen::Matrix3d rotation_from_z(const Eigen::Vector3d& direction);
/// Orthonormal to `tolerance` with determinant +1.
bool is_rotation(const Eigen::Matrix3d& R, double tolerance = 1e-6);
/// Mean of the translations, and the rotation with the least sum of squared chordal distances.
/// @throws InvalidArgument for an empty list.
Pose mean_pose(std::span<const Pose> poses);

}  // namespace kr5
