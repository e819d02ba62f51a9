// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

/// @file
/// Decompositions of small matrices where speed does not count: Eigen's take the compiler seconds for every size and
/// every file that uses one, these are compiled once.

namespace kr5 {

/// A symmetric matrix as V diag(values) V^T.
struct SymmetricEigen {
  Eigen::VectorXd values;   ///< In ascending order.
  Eigen::MatrixXd vectors;  ///< V, of unit columns.
};

/// Eigenvalues and eigenvectors of a symmetric matrix, of which the lower triangle is read.
SymmetricEigen symmetric_eigen(const Eigen::Ref<const Eigen::MatrixXd>& A);

/// Singular values, in descending order.
Eigen::VectorXd singular_values(const Eigen::Ref<const Eigen::MatrixXd>& A);

/// x of the least |A x - b|, by a QR decomposition with column pivoting; of directions that A leaves open, none is
/// used.
Eigen::VectorXd least_squares(const Eigen::Ref<const Eigen::MatrixXd>& A, const Eigen::Ref<const Eigen::VectorXd>& b);

/// Inverse of a symmetric positive semidefinite information matrix, each coordinate scaled by its own information.
/// Combinations of coordinates that keep less than rank_tolerance of their sensitivity, and coordinates of which
/// nothing is known, get none: what the pseudo-inverse gives.
Eigen::MatrixXd covariance_of(const Eigen::MatrixXd& information, double rank_tolerance);

}  // namespace kr5
