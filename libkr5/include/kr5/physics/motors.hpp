// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/cell/cell.hpp>

namespace kr5::physics {

/// Motors of a cell with their effects, one a joint: from joint torques to currents and back.
struct Motors {
  Eigen::MatrixXd structure;        ///< Between torques and currents, n x n: wrist_coupling is in it [-].
  Eigen::MatrixXd inverse;          ///< Of `structure`.
  Eigen::VectorXd rotor_inertia;    ///< Motor side [kg m^2].
  Eigen::VectorXd torque_constant;  ///< [N m/A]

  /// Needs drives. @throws InvalidArgument naming the field: sizes, a structure matrix that has no inverse.
  explicit Motors(const cell::Cell& cell);

  /// Inertia of the rotors in joint coordinates, S^T J S.
  Eigen::MatrixXd rotor_matrix() const;
  /// Motor currents [A], a row a sample, of motor-side accelerations and joint torques, friction included: N x n.
  Eigen::MatrixXd currents(const Eigen::Ref<const Eigen::MatrixXd>& acceleration,
                           const Eigen::Ref<const Eigen::MatrixXd>& torque) const;
  /// Joint torques that currents make.
  Eigen::VectorXd torques(const Eigen::VectorXd& currents) const;
};

/// Structure matrix between torques and currents, with the element that the effect replaces. Needs drives.
Eigen::MatrixXd wrist_coupling(const cell::Cell& cell);
/// Inertia of each rotor, motor side [kg m^2]. Needs drives.
Eigen::VectorXd rotor_inertia(const cell::Cell& cell);
/// Torque of each motor over its current [N m/A]. Needs drives.
Eigen::VectorXd torque_constant(const cell::Cell& cell);
/// Joint torques that a controller makes of motor currents, a row a sample, by the nominal constants: what it logs as
/// torques or efforts [N m or N]. Needs drives.
Eigen::MatrixXd reported_torques(const cell::Cell& cell, const Eigen::Ref<const Eigen::MatrixXd>& currents);
/// How late currents are logged [s].
double current_delay(const cell::Cell& cell);

}  // namespace kr5::physics
