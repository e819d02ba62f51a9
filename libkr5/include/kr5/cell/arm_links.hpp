// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <string>
#include <vector>

#include <kr5/cell/cell.hpp>

/// @file
/// A serial arm as descriptions of robots (URDF, MJCF, SDF) have it: links whose frames lie on the axes of their
/// joints, instead of Denavit-Hartenberg rows.

namespace kr5::cell {

/// A link and the joint that moves it.
struct ArmLink {
  std::string joint;  ///< Name of the joint.
  kinematics::JointType type = kinematics::JointType::Revolute;
  /// The link in the base when every joint value is zero [m]. Its Z axis is the axis of the joint.
  Pose T_base_link = Pose::Identity();
  kinematics::Body body;  ///< Mass of the link and of all that is fixed to it, in the link.
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  double velocity = std::numeric_limits<double>::infinity();
  double effort = std::numeric_limits<double>::infinity();
  double viscous = 0.0;   ///< [N m s/rad or N s/m]
  double coulomb = 0.0;   ///< [N m or N]
  double armature = 0.0;  ///< [kg m^2 or kg]

  static void each_field(auto& self, auto&& visit) {
    visit("joint", self.joint, "Name of the joint.");
    visit("type", self.type, "Type of the joint: revolute | prismatic.");
    visit("T_base_link", self.T_base_link,
          "Link in the base when every joint value is zero; its Z axis is the axis of the joint [m, rad].");
    visit("body", self.body, "Mass of the link and of all that is fixed to it, in the link.");
    visit("lower", self.lower, "Least joint value, -inf where there is none [rad or m].");
    visit("upper", self.upper, "Greatest joint value, inf where there is none [rad or m].");
    visit("velocity", self.velocity, "Greatest joint speed, inf where it is not known [rad/s or m/s].");
    visit("effort", self.effort, "Greatest joint torque, inf where it is not known [N m or N].");
    visit("viscous", self.viscous, "Viscous friction of the joint [N m s/rad or N s/m].");
    visit("coulomb", self.coulomb, "Coulomb friction of the joint [N m or N].");
    visit("armature", self.armature, "Inertia of the drive on the joint side [kg m^2 or kg].");
  }
};

/// An arm from its base to its tip.
struct ArmLinks {
  std::vector<ArmLink> links;          ///< One a joint, from the base.
  Pose T_base_tip = Pose::Identity();  ///< When every joint value is zero: the flange, or what is fixed to it.

  static void each_field(auto& self, auto&& visit) {
    visit("links", self.links, "Links with their joints, from the base.");
    visit("T_base_tip", self.T_base_tip, "Tip in the base when every joint value is zero [m, rad].");
  }
};

/// The arm of a cell, effects apart; the tip is the flange. The last link carries no tool. Joints without names are
/// joint_1 ... joint_n. The inertia of a drive is what turns with its joint alone, the diagonal of S^T J S.
ArmLinks arm_links(const Cell& cell);

/// How each link of an arm has been displaced when the arm has become another, in the base, every joint value zero:
/// what stood at T before stands at the displacement times T. A link goes with the frame on its axis, which a change of
/// the zero of its joint turns. Frames that lie elsewhere on the same axes, by more than 5 cm or 0.2 rad, are those of
/// a description of its own and no change of the arm.
/// @throws InvalidArgument for arms of which an axis lies further apart than a tenth of the reach, or is turned by more
/// than 0.2 rad, or with another number of joints.
std::vector<Pose> link_displacements(const ArmLinks& before, const ArmLinks& after);

/// Whether a chain that branches is an arm which ends there: what follows has no joints, as frames that are fixed to
/// the flange, or fewer than the arm of at least four, as the fingers of a hand. The arms of a torso are longer than
/// it.
/// @param behind Joints on the longest way from the branch to an end.
bool arm_ends_before(int joints, int behind);

/// Joints whose limits are no range: the lower one is not below the upper one, or one is beyond 50 rad or 20 m, which
/// exporters write where they know none.
std::vector<std::string> joints_without_range(const ArmLinks& arm);

/// A cell with that arm: `T_base_tool` is the pose of the tip for the same joint values. A tool without mass when the
/// tip lies beside the last joint axis, and drives of unit gear and motor (a current is a joint torque) when a joint
/// has friction or a rotor. Joint axes less than 3 degrees from parallel get a Hayati angle. The joints of
/// joints_without_range have no limits, nor have speeds above 1e3 rad/s or m/s and efforts above 1e6 N m or N.
/// @throws InvalidArgument when there is no link.
Cell cell_of_links(const ArmLinks& arm);

}  // namespace kr5::cell
