// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/friction.hpp>

#include <cmath>

namespace kr5::physics {

using Eigen::ArrayXd;

JointFriction::JointFriction(const cell::Cell& cell, int joint)
    : coulomb(coulomb_friction(cell, joint)), viscous(viscous_friction(cell, joint)) {
  stribeck = cell.effects.number("stribeck_friction", "stribeck", joint);
  stribeck_velocity = cell.effects.number("stribeck_friction", "stribeck_velocity", joint);
  load_coefficient = cell.effects.number("load_friction", "coefficient", joint);
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
Value thermal_friction(const JointFriction& friction, const Value& t) {
  using std::exp;
  return 1.0 - friction.thermal_drop * (1.0 - exp(-t / friction.thermal_time_constant));
}

template <class Value>
Value dry_friction_level(const JointFriction& friction, const Value& speed, const Value& torque) {
  Value level = speed;
  level = friction.coulomb;
  if (friction.stribeck != 0.0) level += stribeck_friction(friction, speed);
  if (friction.load_coefficient != 0.0) level += load_friction(friction, torque);
  return level;
}

template <class Value>
Value joint_friction(const JointFriction& friction, const Value& speed, const Value& torque, const Value& t) {
  Value out = dry_friction_level(friction, speed, torque) * smoothed_sign(speed) + friction.viscous * speed;
  if (friction.thermal_drop != 0.0) out *= thermal_friction(friction, t);
  return out;
}

namespace {

double thermal_factor(const JointFriction& friction, double t) {
  return friction.thermal_drop == 0.0 ? 1.0 : thermal_friction(friction, t);
}

}  // namespace

double dry_friction_at(const JointFriction& friction, double speed, double torque, double t) {
  return thermal_factor(friction, t) * dry_friction_level(friction, speed, torque);
}

double viscous_friction_at(const JointFriction& friction, double speed, double t) {
  return thermal_factor(friction, t) * friction.viscous * speed;
}

template double stribeck_friction(const JointFriction&, const double&);
template double load_friction(const JointFriction&, const double&);
template double thermal_friction(const JointFriction&, const double&);
template double dry_friction_level(const JointFriction&, const double&, const double&);
template double joint_friction(const JointFriction&, const double&, const double&, const double&);
template ArrayXd stribeck_friction(const JointFriction&, const ArrayXd&);
template ArrayXd load_friction(const JointFriction&, const ArrayXd&);
template ArrayXd thermal_friction(const JointFriction&, const ArrayXd&);
template ArrayXd dry_friction_level(const JointFriction&, const ArrayXd&, const ArrayXd&);
template ArrayXd joint_friction(const JointFriction&, const ArrayXd&, const ArrayXd&, const ArrayXd&);

}  // namespace kr5::physics
