// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/kinematics/dh_chain.hpp>

/// @file
/// How joint speeds move the arm, and how well.

namespace kr5::kinematics {

using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// Geometric Jacobian, 6 x n, linear velocity first: that of the origin of X, fixed to the flange, and the angular
/// velocity, both in axes of B [m/rad or 1, rad/rad or 0] (Hayat et al. 2022, eq. B.1-B.3).
/// @throws InvalidArgument when q has not one value a joint.
Jacobian jacobian(const DhChain& chain, const Eigen::VectorXd& q, const Pose& T_flange_x = Pose::Identity());

/// Derivative of the pose of the flange by the parameters of every joint, 6 x 5n: b [m], theta_offset [rad], a [m],
/// alpha and beta [rad] of the first joint, then of the next. Rows: right perturbation of T_base_flange, linear first
/// [m, rad]. That by q is the column of theta_offset, or of b for a prismatic joint.
/// @param T_base_flange Where the pose itself is put, unless null.
/// @throws InvalidArgument when q has not one value a joint.
Jacobian parameter_jacobian(const DhChain& chain, const Eigen::VectorXd& q, Pose* T_base_flange = nullptr);

/// How far a posture is from a singular one.
struct Manipulability {
  double volume = 0.0;              ///< Product of the singular values of J (Yoshikawa's measure).
  Eigen::VectorXd singular_values;  ///< Greatest first.
  double condition = 0.0;           ///< Greatest over least singular value; infinite in a singular posture.

  static void each_field(auto& self, auto&& visit) {
    visit("volume", self.volume, "Product of the singular values of the Jacobian.");
    visit("singular_values", self.singular_values, "Singular values of the Jacobian, in descending order.");
    visit("condition", self.condition,
          "Ratio of the greatest to the least singular value; infinite in a singular posture.");
  }
};

/// @param length Makes linear rows comparable to angular ones: they are divided by it [m].
Manipulability manipulability(const Jacobian& J, double length = 1.0);

/// Joints, counted from 0, whose value is not within its limits by `tolerance` [rad or m]; limits may be infinite.
/// @throws InvalidArgument when the sizes differ.
std::vector<int> outside_limits(const Eigen::VectorXd& q, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
                                double tolerance = 1e-9);

}  // namespace kr5::kinematics
