// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/identification/dynamics.hpp>

#include "identification/log/residual_correlation.hpp"

/// @file
/// Linear estimates from the rows of all joints, each joint with noise of its own that is correlated in time.

namespace kr5::identification {

/// tau_i = X_i beta, joint by joint.
struct JointRows {
  std::vector<JointRegressor> regressors;
  std::vector<int> columns;     ///< Parameters that are estimated, in ascending order.
  Eigen::MatrixXd tau;          ///< Samples x joints.
  std::vector<int> run_starts;  ///< As in JointMotion.
  Eigen::VectorXd used;         ///< Number of rows of each joint that count; the others are zero. Empty: all count.

  double used_rows(Eigen::Index joint) const { return used.size() > 0 ? used[joint] : static_cast<double>(tau.rows()); }
  Eigen::Index samples() const { return tau.rows(); }
  int joints() const { return static_cast<int>(tau.cols()); }
  Eigen::Index size() const { return static_cast<Eigen::Index>(columns.size()); }
};

/// Leaves out the rows of a joint in which it, or a motor that it turns together with others, is slower than a part of
/// its RMS speed, or than twice the noise of its speed: about rest and reversal the side of dry friction is that of the
/// noise, and at rest friction is any force up to its level. The noise leaves out no joint whose direction is known in
/// less than a tenth of the rows.
/// @param structure Of the drives; empty: each joint has its own.
/// @param min_speed Part of the RMS speed [-]; 0: the noise alone decides.
void leave_out_rest(const JointMotion& motion, const Eigen::MatrixXd& structure, double min_speed, JointRows& rows);
/// 1 for the samples that such a limit keeps for a joint, 0 for the others.
Eigen::ArrayXd moving_samples(const JointMotion& motion, const Eigen::MatrixXd& structure, double min_speed, int joint);
double root_mean_square(const Eigen::Ref<const Eigen::VectorXd>& values);

struct JointFitOptions {
  Estimator estimator = Estimator::Weighted;
  double huber = 1.345;
  int max_iterations = 20;
  double rank_tolerance = 1e-7;  ///< Part of a column below which the data do not tell it [-].
};

struct JointFit {
  Eigen::VectorXd beta;               ///< Zero where the data tell nothing beside the others.
  Eigen::MatrixXd covariance;         ///< Infinite on the diagonal there; not widened for `freedom`.
  Eigen::MatrixXd residuals;          ///< Samples x joints.
  Eigen::VectorXd sigma;              ///< Of the residuals of each joint.
  Eigen::VectorXd correlation;        ///< Samples that count as one.
  Eigen::Index merged = 1;            ///< Neighbouring rows that `noise` takes as one.
  std::vector<Autoregression> noise;  ///< Of the rows of each joint, merged; empty when nothing is told.
  double freedom = 1.0;               ///< Independent samples on which the noise of a joint is known.
  Eigen::MatrixXd factor;             ///< R of the rows of all joints as they are used, without weights.
  std::vector<int> untold;            ///< Positions in `columns` that the data do not tell.
  int iterations = 0;
  bool converged = false;
};

/// @param instruments Rows of the same columns, for Estimator::Instruments.
JointFit fit_joint_rows(const JointRows& rows, const JointFitOptions& options,
                        const std::vector<JointRegressor>* instruments = nullptr);

/// Covariance of the scores sum of w_i^2 X_i^T e_i under the noise of a fit.
Eigen::MatrixXd score_covariance(const JointRows& rows, const JointFit& fit, const Eigen::VectorXd& weights);

/// Samples [first, first + count) of a motion.
JointMotion part_of(const JointMotion& motion, Eigen::Index first, Eigen::Index count);

}  // namespace kr5::identification
