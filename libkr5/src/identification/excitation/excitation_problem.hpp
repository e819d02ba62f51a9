// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/core/random.hpp>
#include <kr5/identification/excitation.hpp>
#include <kr5/kinematics/inertial_regressor.hpp>

#include "identification/excitation/arm_clearance.hpp"

namespace kr5::identification {

/// What a design looks at: what a motion tells of the base parameters, and whether the arm may make it. Keeps
/// references to the cell and the options.
class ExcitationProblem {
 public:
  /// @throws InvalidArgument for limits, start and options that do not fit the arm or one another.
  ExcitationProblem(const cell::Cell& cell, const MotionLimits& limits, const ExcitationOptions& options);

  int joints() const { return static_cast<int>(limits_.lower.size()); }
  Eigen::Index base_parameters() const { return static_cast<Eigen::Index>(base_.size()); }
  /// Finite, and less the share that is kept free.
  const MotionLimits& limits() const { return limits_; }

  /// Sum over the samples of Y^T Y, rows over their noise.
  Eigen::MatrixXd information(const JointMotion& states);
  /// What is made small, of the mean information of a sample.
  double value(const Eigen::MatrixXd& mean_information) const;
  double condition(const Eigen::MatrixXd& information, bool scaled) const;
  /// The one that the criterion is about; for D-optimality that of columns of unit length.
  double shown_condition(const Eigen::MatrixXd& information) const;

  /// Nominal torques of the drives, samples x joints; none when the cell has no masses.
  Eigen::MatrixXd torques(const JointMotion& states) const;
  /// Least height of the guarded points above B [m].
  double lowest(const JointMotion& states) const;
  /// How near the arm comes to its keep-out zones.
  NearestApproach nearest_approach(const JointMotion& states) const { return clearance_.along(states); }
  /// The torque that is too great in these states; empty: none.
  std::string torque_objection(const JointMotion& states) const;
  /// What the arm may not do in these states, beside positions, speeds and accelerations; empty: nothing.
  std::string objection(const JointMotion& states) const;
  /// A random posture within the limits in which there is no objection at rest, when a hundred tries find one.
  Eigen::VectorXd clear_posture(Random& random) const;

 private:
  void set_limits(const MotionLimits& limits);
  void check_start() const;
  void find_base();
  /// Rows of Y of one sample, all columns: inertial parameters, then Coulomb, viscous, rotor of all joints.
  void fill_rows(const JointMotion& states, Eigen::Index k, Eigen::MatrixXd& Y);

  const cell::Cell& cell_;
  const ExcitationOptions& options_;
  MotionLimits limits_;
  kinematics::DhChain chain_;
  kinematics::InertialRegressor regressor_;
  ArmClearance clearance_;
  Eigen::VectorXd weight_;  ///< Of the rows of each joint: 1 / noise.
  std::vector<Eigen::Index> base_;
};

}  // namespace kr5::identification
