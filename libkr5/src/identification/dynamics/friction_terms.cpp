// SPDX-License-Identifier: BSD-3-Clause
#include "identification/dynamics/friction_terms.hpp"

#include <algorithm>

#include <kr5/physics/friction.hpp>

namespace kr5::identification {
namespace {

using Eigen::ArrayXd;
using Shapes = std::vector<JointTerms>;

/// The law of friction with one parameter at 1 and the others at 0: its derivative by that parameter.
ArrayXd unit_friction(const physics::JointFriction& unit, const JointSignals& at) {
  return physics::joint_friction<ArrayXd>(unit, {.speed = at.speed, .torque = at.load, .t = at.t});
}

physics::JointFriction unit_law(double physics::JointFriction::*parameter) {
  physics::JointFriction out;
  out.*parameter = 1.0;
  return out;
}

ArrayXd stribeck_column(double velocity, const JointSignals& at) {
  physics::JointFriction unit = unit_law(&physics::JointFriction::stribeck);
  unit.stribeck_velocity = velocity;
  return unit_friction(unit, at);
}

/// Loss of a friction while the gear warms up, per unit of its cold value.
ArrayXd warming_column(physics::JointFriction unit, const JointTerms& terms, const JointSignals& at) {
  const ArrayXd cold = unit_friction(unit, at);
  unit.thermal_drop = 1.0;
  unit.thermal_time_constant = terms.thermal_time_constant;
  return unit_friction(unit, at) - cold;
}

Shapes with(const JointTerms& now, bool JointTerms::*term) {
  if (now.*term) return {};
  JointTerms more = now;
  more.*term = true;
  return {more};
}

Shapes stribeck_offers(const JointTerms& now, const JointSignals& at, double JointTerms::*velocity) {
  const double fastest = at.speed.abs().maxCoeff();
  Shapes out;
  if (now.*velocity > 0 || !(fastest > 0)) return out;
  // A friction of lower speeds than those that are left out would be extrapolated to them.
  for (double part = 0.6; part > std::max(0.01, 2 * at.min_speed / fastest); part *= 0.6) {
    out.push_back(now);
    out.back().*velocity = part * fastest;
  }
  return out;
}

/// A gear warms up over minutes: what changes faster is something else, which would be taken for it. Runs whose clocks
/// begin again do not say how warm it was.
Shapes warming_offers(const JointTerms& now, const JointSignals& at) {
  constexpr double shortest = 30.0;  // time constant [s]
  const double span = at.t.maxCoeff() - at.t.minCoeff();
  Shapes out;
  if (now.thermal_time_constant > 0 || !(now.coulomb || now.viscous)) return out;
  if (!std::is_sorted(at.t.begin(), at.t.end())) return out;
  for (const double part : {0.2, 0.5, 1.2}) {
    if (part * span < shortest) continue;
    out.push_back(now);
    out.back().thermal_time_constant = part * span;
  }
  return out;
}

Shapes temperature_offers(const JointTerms& now, const JointSignals& at) {
  const bool varies = at.temperature.size() > 0 && at.temperature.maxCoeff() > at.temperature.minCoeff();
  return varies && (now.coulomb || now.viscous) ? with(now, &JointTerms::temperature) : Shapes{};
}

/// A second parameter of a term, which is offered with its first, or one that is there only when it is asked for.
Shapes not_offered(const JointTerms&, const JointSignals&) { return {}; }

}  // namespace

JointSignals joint_signals(const JointMotion& motion, const Eigen::MatrixXd& load, int joint) {
  JointSignals out{motion.qd.col(joint), ArrayXd::Zero(motion.samples()), motion.t, {}};
  if (load.size() > 0) out.load = load.col(joint);
  if (motion.temperature.size() > 0) out.temperature = motion.temperature.col(joint);
  return out;
}

JointSignals motor_signals(const Eigen::MatrixXd& structure, const JointMotion& motion, const Eigen::MatrixXd& load,
                           int joint) {
  JointSignals out = joint_signals(motion, load, joint);
  if (is_shared(structure, joint)) out.speed = motion.qd * structure.row(joint).transpose() / structure(joint, joint);
  return out;
}

std::string friction_unit(FrictionFactor factor, bool slides) {
  const std::string torque = slides ? "N" : "N m";
  switch (factor) {
    case FrictionFactor::Speed:
      return slides ? "N s/m" : "N m s/rad";
    case FrictionFactor::Load:
      return "-";
    case FrictionFactor::Temperature:
      return torque + "/K";
    case FrictionFactor::SpeedAndTemperature:
      return slides ? "N s/(m K)" : "N m s/(rad K)";
    case FrictionFactor::One:
      break;
  }
  return torque;
}

bool is_shared(const Eigen::MatrixXd& structure, Eigen::Index joint) {
  return structure.size() > 0 && (structure.row(joint).array() != 0.0).count() > 1;
}

JointSignals FrictionTerm::signals(const Eigen::MatrixXd& structure, const JointMotion& motion,
                                   const Eigen::MatrixXd& load, int joint) const {
  return motor ? motor_signals(structure, motion, load, joint) : joint_signals(motion, load, joint);
}

double FrictionTerm::share(const Eigen::MatrixXd& structure, int joint, int other) const {
  if (!motor) return joint == other ? 1.0 : 0.0;
  return is_shared(structure, joint) ? structure(joint, other) / structure(joint, joint) : 0.0;
}

void FrictionTerm::take_away(JointTerms& terms) const {
  if (choice) terms.*choice = false;
  if (shape) terms.*shape = 0.0;
}

ArrayXd coulomb_column(const JointSignals& at) { return unit_friction(unit_law(&physics::JointFriction::coulomb), at); }
ArrayXd viscous_column(const JointSignals& at) { return unit_friction(unit_law(&physics::JointFriction::viscous), at); }

const std::vector<FrictionTerm>& friction_term_table() {
  using Terms = const JointTerms&;
  using Signals = const JointSignals&;
  using T = JointTerms;
  using F = FrictionFactor;
  static const std::vector<FrictionTerm> table = {
      {"fo", F::One, [](Terms t) { return t.offset; },
       [](Terms, Signals at) -> ArrayXd { return ArrayXd::Ones(at.t.size()); },
       [](Terms now, Signals) { return with(now, &T::offset); }, &T::offset, nullptr},
      {"fcd", F::One, [](Terms t) { return t.direction && !t.offset; },  // beside a constant nothing tells it from that
       [](Terms, Signals at) -> ArrayXd { return physics::smoothed_sign(at.speed).square(); },
       [](Terms now, Signals) { return with(now, &T::direction); }, &T::direction, nullptr},
      {"fvd", F::Speed, [](Terms t) { return t.direction; },
       [](Terms, Signals at) -> ArrayXd { return physics::smoothed_sign(at.speed) * at.speed; }, not_offered,
       &T::direction, nullptr},
      {"fs", F::One, [](Terms t) { return t.stribeck_velocity > 0; },
       [](Terms t, Signals at) { return stribeck_column(t.stribeck_velocity, at); },
       [](Terms now, Signals at) { return stribeck_offers(now, at, &T::stribeck_velocity); }, nullptr,
       &T::stribeck_velocity},
      {"fl", F::Load, [](Terms t) { return t.load; },
       [](Terms, Signals at) { return unit_friction(unit_law(&physics::JointFriction::load_coefficient), at); },
       [](Terms now, Signals) { return with(now, &T::load); }, &T::load, nullptr},
      {"fct", F::One, [](Terms t) { return t.thermal_time_constant > 0 && t.coulomb; },
       [](Terms t, Signals at) { return warming_column(unit_law(&physics::JointFriction::coulomb), t, at); },
       warming_offers, nullptr, &T::thermal_time_constant},
      {"fvt", F::Speed, [](Terms t) { return t.thermal_time_constant > 0 && t.viscous; },
       [](Terms t, Signals at) { return warming_column(unit_law(&physics::JointFriction::viscous), t, at); },
       [](Terms now, Signals at) { return now.coulomb ? Shapes{} : warming_offers(now, at); }, nullptr,
       &T::thermal_time_constant},
      {"fcT", F::Temperature, [](Terms t) { return t.temperature && t.coulomb; },
       [](Terms t, Signals at) -> ArrayXd { return coulomb_column(at) * (at.temperature - t.temperature_reference); },
       temperature_offers, &T::temperature, nullptr},
      {"fvT", F::SpeedAndTemperature, [](Terms t) { return t.temperature && t.viscous; },
       [](Terms t, Signals at) -> ArrayXd { return viscous_column(at) * (at.temperature - t.temperature_reference); },
       [](Terms now, Signals at) { return now.coulomb ? Shapes{} : temperature_offers(now, at); }, &T::temperature,
       nullptr},
      {"fcm", F::One, [](Terms t) { return t.motor && t.coulomb; },
       [](Terms, Signals at) { return coulomb_column(at); }, [](Terms now, Signals) { return with(now, &T::motor); },
       &T::motor, nullptr, true},
      {"fvm", F::Speed, [](Terms t) { return t.motor && t.viscous; },
       [](Terms, Signals at) { return viscous_column(at); },
       [](Terms now, Signals) { return now.coulomb ? Shapes{} : with(now, &T::motor); }, &T::motor, nullptr, true},
      {"fsm", F::One, [](Terms t) { return t.motor_stribeck_velocity > 0; },
       [](Terms t, Signals at) { return stribeck_column(t.motor_stribeck_velocity, at); },
       [](Terms now, Signals at) { return stribeck_offers(now, at, &T::motor_stribeck_velocity); }, nullptr,
       &T::motor_stribeck_velocity, true},
  };
  return table;
}

}  // namespace kr5::identification
