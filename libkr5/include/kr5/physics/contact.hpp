// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>

namespace kr5::physics {

/// Stiffness of the contact [N/m]. Needs a contact, as all below.
/// @throws InvalidArgument when it is not positive.
double contact_stiffness(const cell::Cell& cell);
/// Growth of the stiffness over the depth [1/m].
double contact_hardening(const cell::Cell& cell);
/// Coefficient of friction of peg on tube [-].
double contact_friction(const cell::Cell& cell);
/// Compliance of the grip across the peg [m/N].
double gripper_compliance(const cell::Cell& cell);
/// Scales the stiffness of the contact, and of the effect that replaces it.
void scale_contact_stiffness(cell::Cell& cell, double factor);
/// The same of its friction.
void scale_contact_friction(cell::Cell& cell, double factor);

/// Contact of the tool with its effects: contact_stiffness, contact_hardening, contact_friction, and gripper_compliance
/// in series. F = max(k p (1 + h p) + d p', 0) at a depth p.
class EffectiveContact {
 public:
  /// @throws InvalidArgument for a stiffness that is not positive. Needs a contact.
  explicit EffectiveContact(const cell::Cell& cell);

  /// Normal force [N] at a depth [m] that grows with `speed` [m/s].
  double force(double depth, double speed) const;
  /// Depth [m] at which the normal force [N] is held; NaN where softening contact cannot hold it.
  double depth(double force) const;
  double stiffness() const { return stiffness_; }  ///< At the surface, the grip in series [N/m].
  double friction() const { return friction_; }
  double lateral_compliance() const { return lateral_; }  ///< Of the grip [m/N].

  /// Friction on a tilted peg that is rolled round the tube under a held force, in T: against the way of its low side.
  /// @param alpha Azimuth of the peg's axis in T [rad]. @param held Force [N].
  Eigen::Vector3d rolling_friction(double alpha, double held) const;
  /// How far the grip lets the peg go sideways under that friction [m].
  Eigen::Vector2d lateral_displacement(const Eigen::Vector3d& friction) const { return lateral_ * friction.head<2>(); }

 private:
  double stiffness_, damping_, friction_;
  double hardening_;  ///< [1/m]
  double lateral_;    ///< [m/N]
};

}  // namespace kr5::physics
