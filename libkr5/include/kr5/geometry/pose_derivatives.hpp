// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/geometry/pose.hpp>

/// @file
/// Derivatives of rotation vectors and of the six-vectors of poses, exact for any angle.

namespace kr5 {

/// How a change of the rotation vector w turns, first order: exp(w + d) = exp(w) exp(right_jacobian(w) d).
Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& w);
/// Its inverse, for angles below a full turn: log(exp(w) exp(d)) = w + right_jacobian_inverse(w) d.
Eigen::Matrix3d right_jacobian_inverse(const Eigen::Vector3d& w);
/// How a right perturbation changes the six-vector of a pose, first order:
/// to_vector(to_pose(v) * to_pose(d)) = v + vector_by_perturbation(v) d.
Matrix6 vector_by_perturbation(const Vector6& v);

}  // namespace kr5
