// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/kinematics/newton_euler.hpp>

namespace kr5::physics {

/// Actual robot base in the nominal base: Ry(pitch) Rx(roll). Gravity is unchanged.
Pose base_tilt(const cell::Cell& cell);
/// DH row of a joint with the lengths a and b that the effect replaces.
kinematics::DhJoint link_length(const cell::Cell& cell, int joint, kinematics::DhJoint row);
/// DH row of a joint with the twist that the effect replaces.
kinematics::DhJoint link_twist(const cell::Cell& cell, int joint, kinematics::DhJoint row);
/// Link of a joint with the mass that the effect replaces; its inertia changes in proportion. What a massless link
/// gets is a point mass.
kinematics::Body link_mass(const cell::Cell& cell, int joint, kinematics::Body link);
/// Link of a joint with the centre of mass that the effect replaces; its inertia about that centre stays.
kinematics::Body link_com(const cell::Cell& cell, int joint, kinematics::Body link);

/// A law of the mass, the centre of mass or the inertia of a link.
struct LinkLaw {
  std::string_view effect;
  kinematics::Body (*law)(const cell::Cell& cell, int joint, kinematics::Body link);
};
/// All of them, in the order in which they act: what EffectiveArm and fold_effects know of effects of links.
std::span<const LinkLaw> link_laws();

/// Factor of all DH lengths at time t [s] of a session in which the robot warms up.
double thermal_growth(const cell::Cell& cell, double t);

/// Geometry and masses of the arm of a cell with their effects: base_tilt, link_length, link_twist, thermal_growth,
/// link_laws() and payload. Gears and drives are in kr5/physics/effective_drives.hpp.
class EffectiveArm {
 public:
  /// Keeps a reference to the cell.
  explicit EffectiveArm(const cell::Cell& cell);

  int joints() const { return cell_.robot.joints(); }
  /// Links change with the time of the session.
  bool grows() const { return cell_.effects.carries("thermal_growth"); }
  /// Chain in the nominal base, at time t [s] of the session.
  kinematics::DhChain chain(double t) const;
  /// Links with their masses, one a joint; massless where the cell has none.
  std::vector<kinematics::Body> bodies() const;
  /// Equations of motion of arm, tool and payload; links without masses are massless.
  kinematics::Dynamics dynamics(double t) const;
  /// What hangs below the force sensor. Needs a tool.
  kinematics::SensorCut below_sensor() const;

 private:
  const cell::Cell& cell_;
  kinematics::DhChain cold_;  ///< Before any growth.
};

}  // namespace kr5::physics
