// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include <Eigen/Core>

#include <kr5/cell/cell.hpp>

/// @file
/// The law of friction of a joint, on the motor side of its gear, with s = tanh(v / 0.002):
/// thermal * (level s + viscous v + quadratic |v| v), and
/// level = max(0, coulomb + stribeck exp(-(v/vs)^2) + coefficient |torque| + amplitude sin(cycles q + phase))
///         + driven max(0, -torque s).
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
  double driven_coefficient = 0.0;                         ///< [-]
  double quadratic = 0.0;                                  ///< [N m s^2/rad^2 or N s^2/m^2]
  double angle_amplitude = 0.0;                            ///< [N m or N]
  double angle_cycles = 0.0, angle_phase = 0.0;            ///< [-], [rad]; they count with the amplitude
  double thermal_drop = 0.0, thermal_time_constant = 0.0;  ///< [-], [s]; the second counts with the first

  JointFriction() = default;
  /// Without drives in the cell the nominal friction is zero.
  JointFriction(const cell::Cell& cell, int joint);

  /// Whether it asks for the torque through the gear; without, a simulator need not know that.
  bool needs_gear_torque() const { return load_coefficient != 0.0 || driven_coefficient != 0.0; }
};

/// What friction depends on. The position counts where the friction depends on the angle, the torque where it depends
/// on the load.
template <class Value>
struct GearState {
  Value position = {};  ///< Motor side [rad or m].
  Value speed = {};     ///< Motor side [rad/s or m/s].
  Value torque = {};    ///< Through the gear, positive where the motor pushes forwards [N m or N].
  Value t = {};         ///< Of the session [s].
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
/// Share of the dry level that is there where the load drives the motor, as of a gear that is less efficient backwards.
/// @param direction Sign of the speed, from -1 to 1.
template <class Value>
Value driven_friction(const JointFriction& friction, const Value& direction, const Value& torque);
/// Share of the dry level that changes with the angle of the joint; of either sign.
template <class Value>
Value angle_friction(const JointFriction& friction, const Value& position);
/// Friction that grows with the square of the speed, against it.
template <class Value>
Value quadratic_drag(const JointFriction& friction, const Value& speed);
/// Factor of all friction of a gear that has warmed up for t [s]; 1 when cold.
template <class Value>
Value thermal_friction(const JointFriction& friction, const Value& t);

/// Level of the dry friction that is the same in either direction, cold.
template <class Value>
Value dry_friction_level(const JointFriction& friction, const GearState<Value>& state);
/// All friction, the dry part smoothed about zero speed, warm as at the time of the state.
template <class Value>
Value joint_friction(const JointFriction& friction, const GearState<Value>& state);

/// Dry friction of a joint that may stand: `offset` + `level` where it moves forwards, `offset` - `level` backwards,
/// anything between where it stands [N m or N].
struct FrictionRange {
  double level = 0.0, offset = 0.0;

  /// Along a smoothed sign of the speed, without any friction at 0.
  double along(double sign) const { return (level + offset * sign) * sign; }
};

/// The two parts of all friction apart, warm, for a law of motion in which dry friction may hold: the dry one, and what
/// grows with the speed, over the speed [N m s/rad or N s/m].
FrictionRange dry_friction_at(const JointFriction& friction, const GearState<double>& state);
double friction_slope_at(const JointFriction& friction, double speed, double t);

}  // namespace kr5::physics
