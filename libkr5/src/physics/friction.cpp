// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/friction.hpp>

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace kr5::physics {

using Eigen::ArrayXd;

namespace {

template <class Value>
Value not_negative(const Value& value) {
  if constexpr (std::is_same_v<Value, double>)
    return std::max(value, 0.0);
  else
    return value.max(0.0);
}

}  // namespace

JointFriction::JointFriction(const cell::Cell& cell, int joint)
    : coulomb(coulomb_friction(cell, joint)), viscous(viscous_friction(cell, joint)) {
  stribeck = cell.effects.number("stribeck_friction", "stribeck", joint);
  stribeck_velocity = cell.effects.number("stribeck_friction", "stribeck_velocity", joint);
  load_coefficient = cell.effects.number("load_friction", "coefficient", joint);
  driven_coefficient = cell.effects.number("driven_friction", "coefficient", joint);
  quadratic = cell.effects.number("quadratic_drag", "quadratic", joint);
  angle_amplitude = cell.effects.number("angle_friction", "amplitude", joint);
  angle_cycles = cell.effects.number("angle_friction", "cycles", joint);
  angle_phase = cell.effects.number("angle_friction", "phase", joint);
  thermal_drop = cell.effects.number("thermal_friction", "drop", joint);
  thermal_time_constant = cell.effects.number("thermal_friction", "time_constant", joint);
}

double coulomb_friction(const cell::Cell& cell, int joint) {
  return cell.effects.replaced_number("coulomb_friction", "coulomb", joint)
      .value_or(cell.drives ? cell.drives->friction.coulomb[joint] : 0.0);
}

double viscous_friction(const cell::Cell& cell, int joint) {
  return cell.effects.replaced_number("viscous_friction", "viscous", joint)
      .value_or(cell.drives ? cell.drives->friction.viscous[joint] : 0.0);
}

template <class Value>
Value stribeck_friction(const JointFriction& friction, const Value& speed) {
  using std::exp;
  const Value ratio = speed / friction.stribeck_velocity;
  return friction.stribeck * exp(-(ratio * ratio));
}

template <class Value>
Value load_friction(const JointFriction& friction, const Value& torque) {
  using std::abs;
  return friction.load_coefficient * abs(torque);
}

template <class Value>
Value driven_friction(const JointFriction& friction, const Value& direction, const Value& torque) {
  return friction.driven_coefficient * not_negative<Value>(-torque * direction);
}

template <class Value>
Value angle_friction(const JointFriction& friction, const Value& position) {
  using std::sin;
  return friction.angle_amplitude * sin(friction.angle_cycles * position + friction.angle_phase);
}

template <class Value>
Value quadratic_drag(const JointFriction& friction, const Value& speed) {
  using std::abs;
  return friction.quadratic * abs(speed) * speed;
}

template <class Value>
Value thermal_friction(const JointFriction& friction, const Value& t) {
  using std::exp;
  return 1.0 - friction.thermal_drop * (1.0 - exp(-t / friction.thermal_time_constant));
}

template <class Value>
Value dry_friction_level(const JointFriction& friction, const GearState<Value>& state) {
  Value level = state.speed;
  level = friction.coulomb;
  if (friction.stribeck != 0.0) level += stribeck_friction(friction, state.speed);
  if (friction.load_coefficient != 0.0) level += load_friction(friction, state.torque);
  if (friction.angle_amplitude == 0.0) return level;
  return not_negative<Value>(level + angle_friction(friction, state.position));
}

template <class Value>
Value joint_friction(const JointFriction& friction, const GearState<Value>& state) {
  const Value sign = smoothed_sign(state.speed);
  Value level = dry_friction_level(friction, state);
  if (friction.driven_coefficient != 0.0) level += driven_friction(friction, sign, state.torque);
  Value out = level * sign + friction.viscous * state.speed;
  if (friction.quadratic != 0.0) out += quadratic_drag(friction, state.speed);
  if (friction.thermal_drop != 0.0) out *= thermal_friction(friction, state.t);
  return out;
}

namespace {

double thermal_factor(const JointFriction& friction, double t) {
  return friction.thermal_drop == 0.0 ? 1.0 : thermal_friction(friction, t);
}

}  // namespace

FrictionRange dry_friction_at(const JointFriction& friction, const GearState<double>& state) {
  const double warm = thermal_factor(friction, state.t), level = dry_friction_level(friction, state);
  if (friction.driven_coefficient == 0.0) return {warm * level, 0.0};
  const double forwards = driven_friction(friction, 1.0, state.torque),
               backwards = driven_friction(friction, -1.0, state.torque);
  return {warm * (level + 0.5 * (forwards + backwards)), warm * 0.5 * (forwards - backwards)};
}

double friction_slope_at(const JointFriction& friction, double speed, double t) {
  return thermal_factor(friction, t) * (friction.viscous + friction.quadratic * std::abs(speed));
}

template double stribeck_friction(const JointFriction&, const double&);
template double load_friction(const JointFriction&, const double&);
template double driven_friction(const JointFriction&, const double&, const double&);
template double angle_friction(const JointFriction&, const double&);
template double quadratic_drag(const JointFriction&, const double&);
template double thermal_friction(const JointFriction&, const double&);
template double dry_friction_level(const JointFriction&, const GearState<double>&);
template double joint_friction(const JointFriction&, const GearState<double>&);
template ArrayXd stribeck_friction(const JointFriction&, const ArrayXd&);
template ArrayXd load_friction(const JointFriction&, const ArrayXd&);
template ArrayXd driven_friction(const JointFriction&, const ArrayXd&, const ArrayXd&);
template ArrayXd angle_friction(const JointFriction&, const ArrayXd&);
template ArrayXd quadratic_drag(const JointFriction&, const ArrayXd&);
template ArrayXd thermal_friction(const JointFriction&, const ArrayXd&);
template ArrayXd dry_friction_level(const JointFriction&, const GearState<ArrayXd>&);
template ArrayXd joint_friction(const JointFriction&, const GearState<ArrayXd>&);

}  // namespace kr5::physics
