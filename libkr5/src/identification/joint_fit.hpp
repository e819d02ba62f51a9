// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/identification/dynamics.hpp>

/// @file
/// Linear estimates from the rows of all joints, each joint with noise of its own that is correlated in time.

namespace kr5::identification {

/// tau_i = X_i beta, joint by joint.
struct JointRows {
  std::vector<JointRegressor> regressors;
  std::vector<int> columns;     ///< Parameters that are estimated, in ascending order.
  Eigen::MatrixXd tau;          ///< Samples x joints.
  std::vector<int> run_starts;  ///< As in JointMotion.

  Eigen::Index samples() const { return tau.rows(); }
  int joints() const { return static_cast<int>(tau.cols()); }
  Eigen::Index size() const { return static_cast<Eigen::Index>(columns.size()); }
};

struct JointFitOptions {
  Estimator estimator = Estimator::Weighted;
  double huber = 1.345;
  int max_iterations = 20;
  double rank_tolerance = 1e-7;  ///< Part of a column below which the data do not tell it [-].
};

struct JointFit {
  Eigen::VectorXd beta;         ///< Zero where the data tell nothing beside the others.
  Eigen::MatrixXd covariance;   ///< Infinite on the diagonal there; not widened for `freedom`.
  Eigen::MatrixXd residuals;    ///< Samples x joints.
  Eigen::VectorXd sigma;        ///< Of the residuals of each joint.
  Eigen::VectorXd correlation;  ///< Samples that count as one.
  double freedom = 1.0;         ///< Independent samples on which the noise of a joint is known.
  std::vector<int> untold;      ///< Positions in `columns` that the data do not tell.
  int iterations = 0;
  bool converged = false;
};

/// @param instruments Rows of the same columns, for Estimator::Instruments.
JointFit fit_joint_rows(const JointRows& rows, const JointFitOptions& options,
                        const std::vector<JointRegressor>* instruments = nullptr);

/// Samples [first, first + count) of a motion.
JointMotion part_of(const JointMotion& motion, Eigen::Index first, Eigen::Index count);

}  // namespace kr5::identification
