// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/physics/friction.hpp>
#include <kr5/physics/gear_spring.hpp>

/// @file
/// What lies between the motor and the link of a joint. Motor side means joint values as the controller reads them,
/// S^-1 times the motor angles.

namespace kr5::physics {

/// Position, speed and acceleration of a link [rad or m, per s, per s^2].
struct LinkState {
  double q = 0.0, v = 0.0, a = 0.0;
};

/// Link value over motor-side value: q + offset + amplitude sin(cycles q + phase).
struct Transmission {
  double encoder_offset = 0.0;                        ///< [rad or m]
  double amplitude = 0.0, cycles = 0.0, phase = 0.0;  ///< [rad or m], [-], [rad]

  Transmission() = default;
  Transmission(const cell::Cell& cell, int joint);

  bool uniform() const { return amplitude == 0.0; }
  double link(double q) const;
  double slope(double q) const;      ///< First derivative of `link`.
  double curvature(double q) const;  ///< Second derivative of `link`.
  /// The link of a rigid gear whose motor side moves so.
  LinkState motion(double q, double v, double a) const {
    const double rise = slope(q);
    return {link(q), rise * v, rise * a + curvature(q) * v * v};
  }
};

/// Reading of a joint whose link is at its zero, with the sign turned: what is added to a reading [rad or m].
double encoder_offset(const cell::Cell& cell, int joint);
/// Error of the link at a motor-side value [rad or m].
double transmission_error(const Transmission& transmission, double q);

/// Dress pack that pulls a link towards `rest` [N m/rad or N/m], [rad or m].
struct CableSpring {
  double stiffness = 0.0, rest = 0.0;
};
/// Torque by the dress pack on the drive of a joint whose link is at q [N m or N].
double cable_spring(const CableSpring& cable, double q);

/// Torque of a motor that changes with its angle [N m or N], [-], [rad].
struct TorqueRipple {
  double amplitude = 0.0, cycles = 0.0, phase = 0.0;
};
/// Torque that the ripple takes at motor-side value q [N m or N]. `Value` is double or Eigen::ArrayXd.
template <class Value>
Value torque_ripple(const TorqueRipple& ripple, const Value& q);

/// One joint, nominal values and effects in one.
struct JointDrive {
  JointFriction friction;
  GearSpring spring;
  Transmission transmission;
  CableSpring cable;
  TorqueRipple ripple;

  JointDrive() = default;
  JointDrive(const cell::Cell& cell, int joint);
};

/// One a joint of the arm.
std::vector<JointDrive> joint_drives(const cell::Cell& cell);

/// When the links of an arm are at rest.
enum class RestRule {
  Static,  ///< In a static posture, as the formats say of static kinds.
  Motion,  ///< As a motion begins: in balance with the springs.
};
/// Torques that hold the links against gravity at link values q.
using GravityTorque = std::function<Eigen::VectorXd(const Eigen::VectorXd& q)>;

/// Link values at rest for motor-side values: springs sag, play is taken up. Gravity is asked only when a gear gives
/// way.
Eigen::VectorXd links_at_rest(const std::vector<JointDrive>& joints, const Eigen::VectorXd& reading, RestRule rule,
                              const GravityTorque& gravity);

}  // namespace kr5::physics
