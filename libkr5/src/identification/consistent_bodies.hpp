// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/core/levenberg_marquardt.hpp>
#include <kr5/kinematics/inertial_regressor.hpp>

/// @file
/// Bodies that can exist: the pseudo-inertia as U U^T, where U is upper triangular with a positive diagonal (Rucker and
/// Wensing 2022).

namespace kr5::identification {

using BodyCoordinates = Eigen::Matrix<double, 10, 1>;  ///< alpha, d1 d2 d3, s12 s13 s23, t1 t2 t3

/// Parameters Ixx Ixy Ixz Iyy Iyz Izz, m c, m of a body, and their derivative by its coordinates.
Eigen::Matrix<double, 10, 1> body_parameters(const BodyCoordinates& x,
                                             Eigen::Matrix<double, 10, 10>* jacobian = nullptr);
/// @throws InvalidArgument when the body cannot exist: its pseudo-inertia is not positive definite.
BodyCoordinates body_coordinates(const kinematics::Body& body);
/// Standard deviations of the coordinates for a spread of the logarithm of masses and radii [-].
BodyCoordinates coordinate_spread(const BodyCoordinates& x, double spread);

/// Parameters of a model (order of DynamicsRegressor) that fit R chi = z (both whitened) and the priors of the bodies.
struct ConsistentFit {
  Eigen::VectorXd parameters;
  Eigen::MatrixXd covariance;  ///< Of the parameters; empty when they are not determined.
  int iterations = 0;
  bool usable = false;
};
ConsistentFit fit_consistent(const Eigen::MatrixXd& R, const Eigen::VectorXd& z, int joints,
                             const std::vector<kinematics::Body>& priors, double spread);

}  // namespace kr5::identification
