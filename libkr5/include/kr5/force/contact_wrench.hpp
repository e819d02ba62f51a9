// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/force/peg_tube_contact.hpp>

namespace kr5::force {

/// How contacts push back.
struct ContactLaw {
  double stiffness = 1e6;             ///< [N/m]
  double damping = 5.0;               ///< [s/m]
  double friction = 0.18;             ///< [-]
  double tangential_stiffness = 3e5;  ///< [N/m]
  double tangential_damping = 100.0;  ///< [N s/m]

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("stiffness", self.stiffness, "Normal force over depth [N/m].");
    visit("damping", self.damping, "Hunt-Crossley damping: factor 1 + damping * speed on the normal force [s/m].");
    visit("friction", self.friction, "Coefficient of Coulomb friction [-].");
    visit("tangential_stiffness", self.tangential_stiffness,
          "Friction over elastic displacement while sticking [N/m].");
    visit("tangential_damping", self.tangential_damping, "Friction over speed while sticking [N s/m].");
  }
};

/// What friction remembers: how far the peg is strained off the place where it sticks. Start from zeros.
struct Stiction {
  Eigen::Vector3d slip = Eigen::Vector3d::Zero();  ///< [m]
  double spin = 0.0;                               ///< [rad]

  static void each_field(auto& self, auto&& visit) {
    visit("slip", self.slip, "Elastic displacement along the contact, in T [m].");
    visit("spin", self.spin, "Elastic turn about the normal [rad].");
  }
};

/// What the contacts do to the peg.
struct ContactForce {
  Vector6 wrench = Vector6::Zero();  ///< [N, N m]
  double normal = 0.0;               ///< [N]
  double friction = 0.0;             ///< [N]
  bool sliding = false;

  static void each_field(auto& self, auto&& visit) {
    visit("wrench", self.wrench, "Force and torque on the peg about its bottom centre, in T [N, N m].");
    visit("normal", self.normal, "Sum of the normal forces [N].");
    visit("friction", self.friction, "Size of the friction force [N].");
    visit("sliding", self.sliding, "True when friction has reached its limit.");
  }
};

/// Wrench of all contacts on a peg that moves.
///
/// Normal forces sum up to stiffness times the greatest depth, shared by weight times depth, so that the stiffness does
/// not depend on how many points stand for one contact, and nothing jumps when points come and go. Friction is one
/// elastic spring for the whole peg, which yields at friction times the normal forces (sticks without creep below
/// that), and the same about the normal, whose arm is the spread of the contacts.
/// @param twist Velocity of the peg's bottom centre and its angular velocity, in T [m/s, rad/s].
/// @param dt Time since the last call [s].
/// @param stiction In: from the last call; out: for the next one.
ContactForce contact_wrench(const Contacts& contacts, const ContactLaw& law, const Pose& T_tube_peg,
                            const Vector6& twist, double dt, Stiction& stiction) noexcept;

}  // namespace kr5::force
