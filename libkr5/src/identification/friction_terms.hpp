// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/identification/dynamics_model.hpp>

/// @file
/// The further terms of a joint's torque: one row of a table each, which says its parameter, when a joint has it, its
/// column of the regressor and how it is offered. The laws are those of kr5/physics/friction.hpp.

namespace kr5::identification {

/// What a column of friction is computed from, a number a sample.
struct JointSignals {
  Eigen::ArrayXd speed;        ///< [rad/s or m/s]
  Eigen::ArrayXd load;         ///< Torque through the gear [N m or N].
  Eigen::ArrayXd t;            ///< [s]
  Eigen::ArrayXd temperature;  ///< Empty: not measured [deg C].
  double least_speed = 0.0;    ///< Below which samples are left out [rad/s or m/s].
};
/// @param load Torques through the gears, samples x joints; empty: zero.
JointSignals joint_signals(const JointMotion& motion, const Eigen::MatrixXd& load, int joint);

/// One further parameter of a joint.
struct FrictionTerm {
  const char* name;  ///< Of the parameter, before the number of the joint.
  bool (*present)(const JointTerms&);
  Eigen::ArrayXd (*column)(const JointTerms&, const JointSignals&);
  /// Terms of a joint with this one more, for each shape that is worth trying; none where it cannot be told.
  std::vector<JointTerms> (*offers)(const JointTerms& now, const JointSignals&);
  bool motor =
      false;  ///< Of the motor, where several joints turn it: a column of its speed, of which each has its share.
};
const std::vector<FrictionTerm>& friction_term_table();

/// Columns of the Coulomb and the viscous friction of a joint.
Eigen::ArrayXd coulomb_column(const JointSignals& signals);
Eigen::ArrayXd viscous_column(const JointSignals& signals);

}  // namespace kr5::identification
