// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/kinematics/body.hpp>

/// @file
/// Bodies that can exist (Lee, Wensing, Park 2020, "Geometric robot dynamic identification: a convex programming
/// approach"): the pseudo-inertia P = [Sigma, h; h^T, m] of each is positive definite, with Sigma the second moment of
/// its mass about the origin of the link frame. The prior of a body is the log-det divergence of P from that of the
/// expected body, so the whole problem is convex and has one minimum.

namespace kr5::identification {

/// Parameters of a model (order of DynamicsRegressor) that fit R chi = z (both whitened) and the priors of the bodies.
struct ConsistentFit {
  Eigen::VectorXd parameters;
  /// Of the parameters, for rows of R without correlation; empty when they are not determined.
  Eigen::MatrixXd covariance;
  int iterations = 0;
  bool converged = false;  ///< The Newton decrement is a hundredth of a standard deviation of the data, or less.
};

/// @param spread Standard deviation of the logarithm of mass, and of a radius of gyration, of each body [-].
/// @throws InvalidArgument when a prior body cannot exist.
ConsistentFit fit_consistent(const Eigen::MatrixXd& R, const Eigen::VectorXd& z, int joints,
                             const std::vector<kinematics::Body>& priors, double spread, int max_iterations);

}  // namespace kr5::identification
