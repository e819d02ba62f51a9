// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <limits>

#include <kr5/cell/cell.hpp>

namespace kr5::physics {

/// Spring, free play and damper between the motor side and the link of one joint. `lead` is how far the motor side is
/// ahead of the link. The same spring holds at rest and in motion; the rules of which side of its play a link takes
/// under hardly any torque differ, as defined by the format `kr5-cell/1`.
struct GearSpring {
  double stiffness = std::numeric_limits<double>::infinity();  ///< [N m/rad or N/m]
  double gap = 0.0;                                            ///< Whole width of the play [rad or m].
  double damping_ratio = 0.0;                                  ///< Of the link's inertia on the spring [-].
  double side_torque = 0.0;  ///< At rest less than this leaves a link in the middle of its play [N m or N].
  bool sags = true;          ///< The spring gives way at rest; the gear behind a play is too stiff for that.

  bool rigid() const { return stiffness == std::numeric_limits<double>::infinity(); }
  /// -1 or 1: the side on which the gear touches; 0: within the play. A gear without play always touches.
  double touching_side(double lead) const {
    if (gap == 0.0) return 1.0;
    return lead >= 0.5 * gap ? 1.0 : (lead <= -0.5 * gap ? -1.0 : 0.0);
  }
  /// Stretch of the spring behind the play [rad or m].
  double strain(double lead) const { return strain_on(touching_side(lead), lead); }
  /// The same as long as the gear touches on `side`, and so linear in the lead, with this stiffness.
  double strain_on(double side, double lead) const { return std::abs(side) * (lead - 0.5 * gap * side); }
  double stiffness_on(double side) const { return std::abs(side) * stiffness; }
  /// Damper, also within the play, for a link of this inertia [N m s/rad or N s/m].
  double damping(double inertia) const { return 2.0 * damping_ratio * std::sqrt(stiffness * inertia); }
  /// Torque on the link.
  double torque(double lead, double lead_speed, double inertia) const {
    return stiffness * strain(lead) + damping(inertia) * lead_speed;
  }

  /// Lead with which the spring holds `torque`, as a motion begins: also a small torque takes a link to its side, but
  /// not what rounding leaves of none.
  double lead_in_balance(double torque) const;
  /// Lead of a static posture: to a side beyond `side_torque`, and `sags` states whether the spring deflects.
  double lead_at_rest(double torque) const;
};

/// The gear of a joint with joint_elasticity: a spring, around the play of a backlash if there is one.
GearSpring joint_elasticity(const cell::Cell& cell, int joint);
/// The gear of a joint with backlash alone: free play in front of the stiffness of the gear.
GearSpring backlash(const cell::Cell& cell, int joint);
/// The gear of a joint with whichever of the two it carries; rigid without.
GearSpring gear_spring(const cell::Cell& cell, int joint);

}  // namespace kr5::physics
