// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/effective_arm.hpp>

#include <array>
#include <cmath>

#include <kr5/physics/tool.hpp>

namespace kr5::physics {

Pose base_tilt(const cell::Cell& cell) {
  Vector6 tilt = Vector6::Zero();
  tilt[3] = cell.effects.number("base_tilt", "roll");
  tilt[4] = cell.effects.number("base_tilt", "pitch");
  return from_xyzrpy(tilt);
}

kinematics::DhJoint link_length(const cell::Cell& cell, int joint, kinematics::DhJoint row) {
  row.a = cell.effects.replaced_number("link_length", "a", joint).value_or(row.a);
  row.b = cell.effects.replaced_number("link_length", "b", joint).value_or(row.b);
  return row;
}

kinematics::DhJoint link_twist(const cell::Cell& cell, int joint, kinematics::DhJoint row) {
  row.alpha = cell.effects.replaced_number("link_twist", "alpha", joint).value_or(row.alpha);
  return row;
}

kinematics::Body link_mass(const cell::Cell& cell, int joint, kinematics::Body link) {
  const auto mass = cell.effects.replaced_number("link_mass", "mass", joint);
  if (!mass) return link;
  if (link.mass > 0.0) link.inertia *= *mass / link.mass;
  link.mass = *mass;
  return link;
}

kinematics::Body link_com(const cell::Cell& cell, int joint, kinematics::Body link) {
  if (const auto com = cell.effects.replaced_vector("link_com", "com", joint)) link.com = *com;
  return link;
}

std::span<const LinkLaw> link_laws() {
  static constexpr std::array laws = {
      LinkLaw{"link_mass", &link_mass},
      LinkLaw{"link_com", &link_com},
  };
  return laws;
}

double thermal_growth(const cell::Cell& cell, double t) {
  if (!cell.effects.carries("thermal_growth")) return 1.0;
  const double growth = cell.effects.number("thermal_growth", "growth");
  return 1.0 + growth * (1.0 - std::exp(-t / cell.effects.number("thermal_growth", "time_constant")));
}

EffectiveArm::EffectiveArm(const cell::Cell& cell) : cell_(cell), cold_(cell::nominal_chain(cell)) {
  cold_.T_base_0 = base_tilt(cell) * cold_.T_base_0;
  for (int i = 0; i < joints(); ++i) {
    kinematics::DhJoint& row = cold_.joints[static_cast<std::size_t>(i)];
    row = link_twist(cell, i, link_length(cell, i, row));
  }
}

kinematics::DhChain EffectiveArm::chain(double t) const {
  kinematics::DhChain out = cold_;
  const double growth = thermal_growth(cell_, t);
  for (kinematics::DhJoint& row : out.joints) row.a *= growth, row.b *= growth;
  return out;
}

std::vector<kinematics::Body> EffectiveArm::bodies() const {
  std::vector<kinematics::Body> out = cell_.robot.links;
  for (int i = 0; i < static_cast<int>(out.size()); ++i) {
    kinematics::Body& link = out[static_cast<std::size_t>(i)];
    for (const LinkLaw& each : link_laws()) link = each.law(cell_, i, link);
  }
  out.resize(static_cast<std::size_t>(joints()));
  return out;
}

kinematics::Dynamics EffectiveArm::dynamics(double t) const {
  kinematics::Dynamics out(chain(t), bodies(), cell_.robot.gravity);
  if (cell_.tool) {
    const kinematics::SensorCut cut = below_sensor();
    out.add_body(joints() - 1, cut.body, cut.T_link_sensor);
  }
  return out;
}

kinematics::SensorCut EffectiveArm::below_sensor() const {
  return {joints() - 1, cell_.tool->T_flange_sensor, payload(cell_)};
}

}  // namespace kr5::physics
