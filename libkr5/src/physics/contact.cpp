// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/contact.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <kr5/core/error.hpp>

namespace kr5::physics {

double contact_stiffness(const cell::Cell& cell) {
  const double stiffness =
      cell.effects.replaced_number("contact_stiffness", "stiffness").value_or(cell.contact->stiffness);
  require(stiffness > 0.0, "contact.stiffness: found " + std::to_string(stiffness) + ", expected more than 0 N/m");
  return stiffness;
}

double contact_hardening(const cell::Cell& cell) {
  constexpr double per_metre = 1e3;  // the effect is stated per millimetre of depth
  return cell.effects.number("contact_hardening", "hardening") * per_metre;
}

double contact_friction(const cell::Cell& cell) {
  return cell.effects.replaced_number("contact_friction", "friction").value_or(cell.contact->friction);
}

double gripper_compliance(const cell::Cell& cell) { return cell.effects.number("gripper_compliance", "lateral"); }

void scale_contact_stiffness(cell::Cell& cell, double factor) {
  cell.contact->stiffness *= factor;
  if (const auto replaced = cell.effects.replaced_number("contact_stiffness", "stiffness"))
    cell.effects.set("contact_stiffness", "contact", "stiffness", *replaced * factor);
}

void scale_contact_friction(cell::Cell& cell, double factor) {
  cell.contact->friction *= factor;
  if (const auto replaced = cell.effects.replaced_number("contact_friction", "friction"))
    cell.effects.set("contact_friction", "contact", "friction", *replaced * factor);
}

EffectiveContact::EffectiveContact(const cell::Cell& cell)
    : stiffness_(contact_stiffness(cell)),
      damping_(cell.contact->damping),
      friction_(contact_friction(cell)),
      hardening_(contact_hardening(cell)),
      lateral_(physics::gripper_compliance(cell)) {
  const double axial = cell.effects.number("gripper_compliance", "axial");
  if (axial != 0.0) stiffness_ = 1.0 / (1.0 / stiffness_ + axial);
}

double EffectiveContact::force(double depth, double speed) const {
  if (depth <= 0.0) return 0.0;
  return std::max(stiffness_ * depth * (1.0 + hardening_ * depth) + damping_ * speed, 0.0);
}

double EffectiveContact::depth(double force) const {
  const double p = force / stiffness_;  // of a linear spring
  if (hardening_ == 0.0) return p;
  const double root = 1.0 + 4.0 * hardening_ * p;
  return root >= 0.0 ? 2.0 * p / (1.0 + std::sqrt(root)) : std::numeric_limits<double>::quiet_NaN();
}

Eigen::Vector3d EffectiveContact::rolling_friction(double alpha, double held) const {
  return friction_ * held * Eigen::Vector3d(std::sin(alpha), -std::cos(alpha), 0.0);
}

}  // namespace kr5::physics
