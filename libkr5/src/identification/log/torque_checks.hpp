// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "identification/log/log_checks.hpp"

namespace kr5::identification {

/// Regression of torques on their motion without knowledge of the arm: a polynomial of the positions, speeds,
/// directions of motion and accelerations of every joint.
class MotionRegression {
 public:
  /// @param rows Of the log, for the fit.
  MotionRegression(const SmoothedLog& smooth, std::vector<Index> rows);

  Index rows() const { return static_cast<Index>(rows_.size()); }
  Index parameters() const { return basis_.cols(); }
  /// Torques at the rows of the fit, `lag` rows later.
  MatrixXd torques(const MatrixXd& tau, Index lag) const;
  /// Residual sum of squares of each joint when torques of `lag` rows later belong to the motion.
  VectorXd cost(const MatrixXd& tau, Index lag) const;
  /// Coefficients of all torques for that lag, parameters x joints.
  MatrixXd coefficients(const MatrixXd& tau, Index lag) const;
  /// Torques the regression gives at a row, from coefficients.
  VectorXd predict(const MatrixXd& coefficients, Index row) const;
  /// Variance of a prediction at a row, over that of a residual [-].
  double leverage(Index row) const;
  /// (B^T B)^-1
  const MatrixXd& inverse() const { return inverse_; }

  Index speed(Index joint) const { return first_speed_ + joint; }
  Index direction(Index joint) const { return first_speed_ + joints_ + joint; }
  Index acceleration(Index joint) const { return first_speed_ + 2 * joints_ + joint; }
  const MatrixXd& basis() const { return basis_; }

 private:
  VectorXd basis_row(Index row) const;
  const SmoothedLog& smooth_;
  std::vector<Index> rows_;
  Index joints_ = 0, first_speed_ = 0;
  VectorXd middle_, half_range_, still_, speed_scale_, acceleration_scale_;
  MatrixXd basis_, inverse_;
};

}  // namespace kr5::identification
