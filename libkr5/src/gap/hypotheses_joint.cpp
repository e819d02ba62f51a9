// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "gap/hypothesis_builder.hpp"
#include "gap/sizes.hpp"

namespace kr5::gap {
namespace {

using cell::Cell;
using cell::EffectValue;
using cell::set_effect;

std::string joint_name(int joint) { return "joint" + std::to_string(joint + 1); }

/// An amplitude with a shape that is no size: the signature is taken at several shapes.
std::vector<Probe> at_shapes(std::initializer_list<double> shapes) {
  std::vector<Probe> out;
  for (const double shape : shapes) out.push_back({{point({1.0, shape})}});
  return out;
}

}  // namespace

void add_joint_friction(HypothesisBuilder& b, int joint) {
  const std::string at = joint_name(joint);
  const auto& drives = b.cell.drives;
  const double dry = sizes::friction(b.cell, joint), slope = sizes::viscous(b.cell, joint);
  b.number("coulomb_friction", at, "coulomb", drives ? drives->friction.coulomb(joint) : 0.0, sizes::part * dry, 0.0);
  b.number("viscous_friction", at, "viscous", drives ? drives->friction.viscous(joint) : 0.0, sizes::part * slope, 0.0);
  b.number("load_friction", at, "coefficient", 0.0, 0.02, 0.0, 1.0);
  // Speeds at which friction is known to fade run over three decades: the logarithm is the coordinate.
  b.add(
      "stribeck_friction", at, {{0.0}, {std::log(3e-3), std::log(2.0), 0.05, true}},
      [=](Cell& c, const Point& x) {
        set_effect(c, "stribeck_friction", at, "stribeck", EffectValue(sizes::part * dry * x(0)));
        set_effect(c, "stribeck_friction", at, "stribeck_velocity", EffectValue(std::exp(x(1))));
      },
      at_shapes({std::log(0.01), std::log(0.03), std::log(0.1), std::log(0.3)}));
  const double span = std::max(b.span.last - b.span.first, 1.0);
  b.add(
      "thermal_friction", at, {{0.0, 1.0 / sizes::part}, {std::log(span / 100), std::log(30 * span), 0.05, true}},
      [=](Cell& c, const Point& x) {
        set_effect(c, "thermal_friction", at, "drop", EffectValue(sizes::part * x(0)));
        set_effect(c, "thermal_friction", at, "time_constant", EffectValue(std::exp(x(1))));
      },
      at_shapes({std::log(0.1 * span), std::log(0.5 * span), std::log(3 * span)}));
}

void add_joint_drive(HypothesisBuilder& b, int joint) {
  const std::string at = joint_name(joint);
  const cell::Drives& drives = *b.cell.drives;
  const double dry = sizes::friction(b.cell, joint);
  b.number("torque_constant", at, "torque_constant", drives.torque_constant(joint),
           sizes::scale * drives.torque_constant(joint), 0.1 * drives.torque_constant(joint));
  const double rotor = std::max(drives.rotor_inertia(joint), 1e-6);
  b.number("rotor_inertia", at, "rotor_inertia", drives.rotor_inertia(joint), sizes::part * rotor, 0.0);
  // Torque -stiffness (q - rest): linear in stiffness and stiffness rest. A dress pack rests within reach of the joint:
  // one that rests far away would be a constant torque by another name.
  const double spring = sizes::part * dry;
  const auto& limits = b.cell.robot.limits;
  const double first = limits ? limits->lower(joint) - 0.5 : -6.3, last = limits ? limits->upper(joint) + 0.5 : 6.3;
  b.add("cable_spring", at, {{1e-3}, {}},
        [=](Cell& c, const Point& x) {
          set_effect(c, "cable_spring", at, "stiffness", EffectValue(spring * x(0)));
          set_effect(c, "cable_spring", at, "rest", EffectValue(std::clamp(x(1) / std::max(x(0), 1e-3), first, last)));
        },
        {{{point({1.0, first}), point({1.0, last})}}});
  // Compliance is nearly linear, stiffness is not: 1 is an angle of `sizes::angle` under three times the dry friction.
  const double compliance = sizes::angle / (3 * dry);
  b.add("joint_elasticity", at, {{0.0, 1e3}},
        [=](Cell& c, const Point& x) {
          std::optional<EffectValue> stiffness;
          if (x(0) > 0) stiffness = EffectValue(1 / (compliance * x(0)));
          set_effect(c, "joint_elasticity", at, "stiffness", stiffness);
        },
        {unit_probe(1, 0.3), unit_probe(1, 3.0)});
  b.add("backlash", at, {{0.0, 0.2 / sizes::angle, 0.1}},
        [=](Cell& c, const Point& x) { set_effect(c, "backlash", at, "gap", EffectValue(sizes::angle * x(0))); },
        {unit_probe(1, 0.5), unit_probe(1, 2.0)})
      .inaccuracy = 0.2;  // its blows last less than a row, and how hard they are hangs on their instant
}

void add_joint_geometry(HypothesisBuilder& b, int joint) {
  const std::string at = joint_name(joint);
  const kinematics::DhJoint& row = b.cell.robot.dh[static_cast<std::size_t>(joint)];
  b.number("encoder_offset", at, "offset", 0.0, sizes::angle);
  b.number("link_twist", at, "alpha", row.alpha, sizes::angle);
  for (const auto& [name, nominal] : {std::pair{"a", row.a}, {"b", row.b}}) {
    Hypothesis& h = b.number("link_length", at, name, nominal, sizes::length);
    h.choice = name;
    h.log_prior = -std::log(2.0);
  }
}

void add_couplings(HypothesisBuilder& b) {
  const Eigen::MatrixXd& S = b.cell.drives->structure;
  for (int motor = 0; motor < S.rows(); ++motor)
    for (int element = 0; element < S.cols(); ++element) {
      if (element == motor) continue;  // that is a gear ratio, not a coupling
      const std::string at = "motor" + std::to_string(motor + 1);
      const double nominal = S(motor, element);
      const double size = 0.01 * std::sqrt(std::abs(S(motor, motor) * S(element, element)));
      Hypothesis& h = b.add("wrist_coupling", at, {{}}, [=](Cell& c, const Point& x) {
        set_effect(c, "wrist_coupling", at, "element", EffectValue(static_cast<double>(element)));
        set_effect(c, "wrist_coupling", at, "value", EffectValue(nominal + size * x(0)));
      });
      h.choice = "element " + std::to_string(element);
      h.log_prior = -std::log(static_cast<double>(S.cols() - 1));
    }
}

}  // namespace kr5::gap
