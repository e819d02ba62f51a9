// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/identification/dynamics_model.hpp>

/// @file
/// Which columns of a tall matrix depend on which, and its triangular factor without the matrix.

namespace kr5::identification {

/// Columns that those taken before them do not span.
struct IndependentColumns {
  std::vector<int> columns;  ///< In the order in which they were taken.
  Eigen::MatrixXd basis;     ///< Orthonormal, of what they span: a column each.
};

/// Takes columns in the given order, but those no longer than `nothing` and those of which no more than `tolerance` of
/// their length is left beside the ones before.
IndependentColumns independent_columns(const Eigen::MatrixXd& A, const std::vector<int>& order, double tolerance,
                                       double nothing);

/// Columns of a matrix, split into independent and dependent ones: dependent = independent * coefficients.
struct ColumnSplit {
  std::vector<int> independent, dependent;  ///< In ascending order.
  Eigen::MatrixXd coefficients;             ///< independent x dependent.
};

/// Takes columns in the given order; one of which less than `tolerance` of its length is left beside those before it
/// depends on them.
ColumnSplit split_columns(const Eigen::MatrixXd& A, const std::vector<int>& order, double tolerance);

/// Upper triangular R with R^T R = A^T A, by Householder reflections on some rows at a time.
Eigen::MatrixXd triangular_factor(const Eigen::Ref<const Eigen::MatrixXd>& A);

/// R of all joints' rows under each other, each joint times its weight, over all columns (of which `columns` says the
/// parameters); with `last`, the factors have one column more.
Eigen::MatrixXd stacked_factor(const std::vector<Eigen::MatrixXd>& factors,
                               const std::vector<std::vector<int>>& positions, Eigen::Index columns,
                               const Eigen::VectorXd& weights);

/// Positions in `columns` of the parameters of each joint's rows.
std::vector<std::vector<int>> column_positions(const std::vector<JointRegressor>& rows,
                                               const std::vector<int>& columns);

/// "I2zz + Ia2 - 0.36 m2".
std::string linear_expression(const Eigen::VectorXd& coefficients, const std::vector<std::string>& names);

/// Order in which parameters are kept as base parameters.
std::vector<int> preferred_order(int joints, int parameters);

}  // namespace kr5::identification
