// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>

#include <kr5/cell/cell.hpp>

/// @file
/// Motors, gears and joint servos of a cell with their effects: the laws, without any state. Motor side means joint
/// values as the controller reads them, S^-1 times the motor angles.

namespace kr5::sim {

/// Spring, play and damper between the motor side and the link of one joint.
struct GearSpring {
  double stiffness = std::numeric_limits<double>::infinity();  ///< [N m/rad or N/m]
  double gap = 0.0;                                            ///< Whole width of the play [rad or m].
  double damping_ratio = 0.0;                                  ///< Of the link's inertia on the spring [-].

  bool sags = true;  ///< At rest; the gear behind a play is too stiff for that.

  bool rigid() const { return stiffness == std::numeric_limits<double>::infinity(); }
  /// Torque on the link when the motor side leads by `lead`, with damping `2 ratio sqrt(stiffness inertia)`.
  double torque(double lead, double lead_speed, double inertia) const;
  /// How far the motor side leads when the spring holds `torque`: also a small one takes a link to its side, but not
  /// what rounding leaves of none.
  double lead_in_balance(double torque) const;
  /// The same by the rule of the formats for static kinds: to a side from 0.5 N m on, and `sags` says whether the
  /// spring gives way.
  double lead_at_rest(double torque) const;
};

/// One joint, nominal values and effects in one.
struct JointDrive {
  double coulomb = 0.0, viscous = 0.0, stribeck = 0.0, stribeck_velocity = 0.1, load_coefficient = 0.0;
  double thermal_drop = 0.0, thermal_time_constant = 600.0;
  double cable_stiffness = 0.0, cable_rest = 0.0;
  double ripple_amplitude = 0.0, ripple_cycles = 1.0, ripple_phase = 0.0;
  double encoder_offset = 0.0;
  double error_amplitude = 0.0, error_cycles = 1.0, error_phase = 0.0;  ///< Of the transmission.
  GearSpring spring;

  /// Level of the dry friction at speed v under a transmitted torque, warm as at time t.
  double dry_friction(double v, double transmitted, double t) const;
  double viscous_friction(double v, double t) const;
  /// All friction at motor-side speed v, dry part smoothed as tanh(v / 0.002).
  double friction(double v, double transmitted, double t) const;
  /// Torque that the ripple of the motor takes at motor-side value q, and the cable at link value q.
  double ripple(double q) const;
  double cable(double q) const;
  /// Link value over motor-side value: encoder offset and transmission error, with its derivatives.
  double link(double q) const;
  double link_slope(double q) const;
  double link_curvature(double q) const;

 private:
  double cold(double t) const;
};

/// All joints of a cell.
struct Drives {
  std::vector<JointDrive> joints;
  bool motors = false;                   ///< The cell has drives; without them there is neither friction nor current.
  Eigen::MatrixXd structure;             ///< Between torques and currents: wrist_coupling is in it.
  Eigen::VectorXd rotor_inertia;         ///< Motor side [kg m^2].
  Eigen::VectorXd torque_constant;       ///< [N m/A]
  std::vector<cell::SecondOrder> servo;  ///< One a joint; empty when the cell has no joint servo.

  /// @throws InvalidArgument naming the field: sizes, a structure matrix that has no inverse.
  explicit Drives(const cell::Cell& cell);

  int size() const { return static_cast<int>(joints.size()); }
  bool rigid() const;
  /// Inertia of the rotors in joint coordinates, S^T J S.
  Eigen::MatrixXd rotor_matrix() const;
  Eigen::VectorXd friction(const Eigen::VectorXd& v, const Eigen::VectorXd& transmitted, double t) const;
  Eigen::VectorXd ripple(const Eigen::VectorXd& q) const;
  Eigen::VectorXd cable(const Eigen::VectorXd& q) const;
  Eigen::VectorXd link(const Eigen::VectorXd& q) const;
  /// Motor currents [A] of motor-side acceleration and joint torque, friction included.
  Eigen::VectorXd currents(const Eigen::VectorXd& acceleration, const Eigen::VectorXd& torque) const;
  /// Joint torques that currents make.
  Eigen::VectorXd torques(const Eigen::VectorXd& currents) const;
};

}  // namespace kr5::sim
