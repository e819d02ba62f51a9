// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include <Eigen/Core>

#include <kr5/cell/cell.hpp>

/// @file
/// The law of friction of a joint, on the motor side of its gear:
/// thermal * ((coulomb + stribeck exp(-(v/vs)^2) + coefficient |torque|) tanh(v / 0.002) + viscous v).
/// `Value` is double (one instant, for stepping) or Eigen::ArrayXd (a value a row, for a whole motion).

namespace kr5::physics {

/// Speed over which the sign of the speed is smoothed, as defined by the format `kr5-cell/1` [rad/s or m/s].
constexpr double friction_smoothing_speed = 0.002;

/// Sign of a speed, smoothed: by it dry friction changes sides.
template <class Value>
Value smoothed_sign(const Value& speed) {
  using std::tanh;
  return tanh(speed / friction_smoothing_speed);
}

/// Friction of one joint: nominal values, replaced and joined by the effects that the cell carries.
struct JointFriction {
  double coulomb = 0.0;                                    ///< [N m or N]
  double viscous = 0.0;                                    ///< [N m s/rad or N s/m]
  double stribeck = 0.0, stribeck_velocity = 0.0;          ///< [N m or N], [rad/s or m/s]; the second counts with it
  double load_coefficient = 0.0;                           ///< [-]
  double thermal_drop = 0.0, thermal_time_constant = 0.0;  ///< [-], [s]; the second counts with the first

  JointFriction() = default;
  /// Without drives in the cell the nominal friction is zero.
  JointFriction(const cell::Cell& cell, int joint);

  /// Whether it asks for the torque through the gear; without, a simulator need not know that.
  bool needs_gear_torque() const { return load_coefficient != 0.0; }
};

/// Level of the dry friction of a joint [N m or N].
double coulomb_friction(const cell::Cell& cell, int joint);
/// Slope of the friction of a joint over its speed [N m s/rad or N s/m].
double viscous_friction(const cell::Cell& cell, int joint);
/// Share of the dry level that is there at low speed only.
template <class Value>
Value stribeck_friction(const JointFriction& friction, const Value& speed);
/// Share of the dry level that grows with the torque through the gear.
template <class Value>
Value load_friction(const JointFriction& friction, const Value& torque);
/// Factor of all friction of a gear that has warmed up for t [s]; 1 when cold.
template <class Value>
Value thermal_friction(const JointFriction& friction, const Value& t);

/// Level of the dry friction at a speed, under a transmitted torque, cold.
template <class Value>
Value dry_friction_level(const JointFriction& friction, const Value& speed, const Value& torque);
/// All friction, the dry part smoothed about zero speed, warm as at time t.
template <class Value>
Value joint_friction(const JointFriction& friction, const Value& speed, const Value& torque, const Value& t);

/// The two parts of it apart, warm as at time t, for a law of motion in which dry friction may hold: the level of the
/// dry one, and what grows with the speed [N m or N].
double dry_friction_at(const JointFriction& friction, double speed, double torque, double t);
double viscous_friction_at(const JointFriction& friction, double speed, double t);

}  // namespace kr5::physics
