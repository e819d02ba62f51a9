// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include <kr5/kinematics/inertial_regressor.hpp>

/// @file
/// Inverse dynamics by the decoupled natural orthogonal complement (DeNOC; Saha 1999; Hayat et al. 2022, eqs.
/// 4.19-4.33): tau = N_d^T N_l^T V chi. It shares no code with Dynamics, which is faster.
///
/// Twists and wrenches have the linear part first and are about the origin and in the axes of the link frame, which is
/// behind its joint; so p_i of a revolute joint is [z x r, z] with r from the axis to that origin, where the book,
/// whose origins lie on the axis, has [0, z] in its order.

namespace kr5::kinematics {

/// The factors of the regressor for one motion of a chain of n joints.
struct Denoc {
  Eigen::MatrixXd N_l;  ///< 6n x 6n, lower block triangular: twists of the links from those of the joints alone (4.28).
  Eigen::MatrixXd N_d;  ///< 6n x n, block diagonal: twists of the joints from their rates (4.28).
  Eigen::MatrixXd V;    ///< 6n x 10n, block diagonal: wrenches from InertialParameters (4.19, with 4.33 for gravity).

  /// Y = N_d^T N_l^T V (4.29), n x 10n.
  Eigen::MatrixXd regressor() const { return N_d.transpose() * (N_l.transpose() * V); }
  /// Twists of the links, 6n, for joint rates.
  Eigen::VectorXd twists(const Eigen::VectorXd& qd) const { return N_l * (N_d * qd); }
};

/// @param gravity In B [m/s^2]. @throws InvalidArgument when q, qd or qdd has not one value a joint.
Denoc denoc(const DhChain& chain, const Eigen::VectorXd& q, const Eigen::VectorXd& qd, const Eigen::VectorXd& qdd,
            const Eigen::Vector3d& gravity = {0.0, 0.0, -9.81});

/// Joint torques [N m or N] by the recursions that N_l and N_d stand for, without these matrices.
/// @param bodies One a joint, in the frame of its link. @throws InvalidArgument when a size is not the number of
/// joints.
Eigen::VectorXd denoc_torques(const DhChain& chain, std::span<const Body> bodies, const Eigen::VectorXd& q,
                              const Eigen::VectorXd& qd, const Eigen::VectorXd& qdd,
                              const Eigen::Vector3d& gravity = {0.0, 0.0, -9.81});

}  // namespace kr5::kinematics
