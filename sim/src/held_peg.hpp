// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/force/contact_wrench.hpp>
#include <kr5/physics/contact.hpp>

namespace kr5::sim {

/// What holds a peg, and what pushes it when it is let go.
struct Grip {
  double lateral = 0.0, angular = 0.0;                ///< [N/m], [N m/rad]
  double height = 0.0;                                ///< Above the peg's bottom [m].
  double guide = 0.01;                                ///< Length on which a peg that slides out is still guided [m].
  double air = 10.0;                                  ///< Force of the air on a peg that was let go [N].
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  ///< In the tube [m/s^2].
};

/// A peg as a rigid body between the grip of an arm, which goes where it goes, and the tube. All poses are in the frame
/// of the tube where it really stands.
class HeldPeg {
 public:
  HeldPeg(const cell::Cell& cell, const Grip& grip);

  /// That resolves the contact with the mass that moves: a peg alone is lighter [s].
  double longest_step() const;
  void place(const Pose& T_tube_peg);
  /// It stays behind: nothing is in the grip until it is placed again.
  void leave();
  /// One step while the grip goes to where it would hold the peg so, at that velocity of the peg's bottom and turning.
  void advance(const Pose& held, const Vector6& velocity, double step);
  void hold(bool held, bool air);
  const Pose& pose() const { return T_; }
  /// What the peg does to the grip: force, and torque about the bottom of the held pose [N, N m].
  const Vector6& on_grip() const { return on_grip_; }
  double max_force() const { return greatest_; }
  void forget_greatest() { greatest_ = 0.0; }
  /// The grip still has hold of it, or guides it.
  bool gripped() const { return there_ && slid_ < grip_.guide; }
  const force::PegTubeShape& shape() const { return shape_; }

 private:
  Vector6 from_grip(const Pose& held, const Vector6& velocity, const Eigen::Vector3d& arm) const;
  Vector6 from_tube(double step);
  const force::Contacts& touching(const Vector6& twist, double step);

  force::PegTubeShape shape_;
  Grip grip_;
  physics::EffectiveContact axial_;
  double lateral_, damping_, angular_damping_;
  force::ContactLaw law_;
  force::Stiction stiction_;
  force::Contacts contacts_;
  int searched_ = 0;  ///< Steps until contacts are searched anew.
  double mass_ = 0.0, held_mass_ = 0.0;
  Eigen::Vector3d inertia_ = Eigen::Vector3d::Zero();
  Pose T_ = Pose::Identity();
  Eigen::Vector3d v_ = Eigen::Vector3d::Zero(), w_ = Eigen::Vector3d::Zero();  ///< Of the centre of mass; of the body.
  Vector6 on_grip_ = Vector6::Zero();
  double slid_ = 0.0, rest_ = 0.0, greatest_ = 0.0;
  bool held_ = true, air_ = false, there_ = true;
};

}  // namespace kr5::sim
