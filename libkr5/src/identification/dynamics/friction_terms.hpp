// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
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
  double min_speed = 0.0;      ///< Below which samples are left out [rad/s or m/s].
};
/// @param load Torques through the gears, samples x joints; empty: zero.
JointSignals joint_signals(const JointMotion& motion, const Eigen::MatrixXd& load, int joint);
/// Of the motor of a joint, at its speed on the side of that joint. @param structure Empty: each joint has its own.
JointSignals motor_signals(const Eigen::MatrixXd& structure, const JointMotion& motion, const Eigen::MatrixXd& load,
                           int joint);
/// Whether several joints turn the motor of this one.
bool is_shared(const Eigen::MatrixXd& structure, Eigen::Index joint);

/// What the parameter of a term is multiplied by: its unit times that of this is a torque.
enum class FrictionFactor { One, Speed, Load, Temperature, SpeedAndTemperature };

/// Unit of a parameter of a joint, which turns or slides.
std::string friction_unit(FrictionFactor factor, bool slides);

/// One further parameter of a joint.
struct FrictionTerm {
  const char* name;  ///< Of the parameter, before the number of the joint.
  FrictionFactor factor;
  bool (*present)(const JointTerms&);
  Eigen::ArrayXd (*column)(const JointTerms&, const JointSignals&);
  /// Terms of a joint with this one more, for each shape that is worth trying; none where it cannot be told.
  std::vector<JointTerms> (*offers)(const JointTerms& now, const JointSignals&);
  /// What says that a joint has it: a choice, or a number other than 0 that shapes its column.
  bool JointTerms::*choice;
  double JointTerms::*shape;
  bool motor = false;  ///< Of a motor that several joints turn: a column of its speed, of which each has its share.

  void take_away(JointTerms& terms) const;
  /// Signals of the joint, or of its motor.
  JointSignals signals(const Eigen::MatrixXd& structure, const JointMotion& motion, const Eigen::MatrixXd& load,
                       int joint) const;
  /// Part of the column of a joint's term that another joint feels, itself included [-].
  double share(const Eigen::MatrixXd& structure, int joint, int other) const;
};
const std::vector<FrictionTerm>& friction_term_table();

/// Columns of the Coulomb and the viscous friction of a joint.
Eigen::ArrayXd coulomb_column(const JointSignals& signals);
Eigen::ArrayXd viscous_column(const JointSignals& signals);

}  // namespace kr5::identification
