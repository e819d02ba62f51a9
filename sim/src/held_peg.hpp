// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <limits>
#include <memory>
#include <string_view>
#include <utility>

#include <kr5/core/fields.hpp>
#include <kr5/force/contact_wrench.hpp>
#include <kr5/physics/contact.hpp>

namespace kr5::sim {

struct PegBody {
  double radius = 0.0;      ///< [m]
  double length = 0.0;      ///< [m]
  double density = 7850.0;  ///< Steel [kg/m^3].
};

/// What a peg may touch, in the frame in which it moves.
class PegSurroundings {
 public:
  virtual ~PegSurroundings() = default;
  /// Whether nothing is near a peg at that pose.
  virtual bool clear(const Pose& T_peg) const = 0;
  virtual force::Contacts contacts(const Pose& T_peg) const = 0;
};

/// What holds a peg, and what pushes it when it is let go.
struct Grip {
  double lateral = 0.0, angular = 0.0;                ///< [N/m], [N m/rad]
  double height = 0.0;                                ///< Above the peg's bottom [m].
  double guide = 0.01;                                ///< Length on which a peg that slides out is still guided [m].
  double air = 10.0;                                  ///< Force of the air on a peg that was let go [N].
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  ///< In the frame of the surroundings [m/s^2].
  bool carried = false;   ///< The arm feels the weight of a held peg; otherwise that of the tool has it in it.
  double inertia = 0.0;   ///< Of fingers and held peg; 0: as if the fingers were part of the peg [kg m^2].
  double settling = 0.0;  ///< Damping of a peg that was let go and touches something [1/s].
  double force = std::numeric_limits<double>::infinity();   ///< At which the peg slips [N].
  double torque = std::numeric_limits<double>::infinity();  ///< At which it turns [N m].
  /// Direction in the held peg in which the gripper stands behind it, so that it does not slip; zero: none.
  Eigen::Vector3d support = Eigen::Vector3d::Zero();
};

/// A peg in motion: all that differs from a peg placed anew.
struct HeldPegState {
  Pose T = Pose::Identity();
  Eigen::Vector3d v = Eigen::Vector3d::Zero(), w = Eigen::Vector3d::Zero();
  force::Stiction stiction;
  Pose slip = Pose::Identity();
  double slid = 0.0, rest = 0.0, max_force = 0.0;
  bool held = true, air = false, free = false, there = true;

  static constexpr std::array<std::pair<std::string_view, std::string_view>, 1> file_keys = {
      {{"max_force", "greatest"}}};
  static void each_field(auto& self, auto&& visit) {
    visit("T", self.T, "Bottom centre of the peg, Z along its axis [m].");
    visit("v", self.v, "Velocity of its centre of mass [m/s].");
    visit("w", self.w, "Angular velocity, in its own axes [rad/s].");
    visit("stiction", self.stiction, "What friction remembers.");
    visit("slip", self.slip, "Where the grip holds it, from where it took it [m].");
    visit("slid", self.slid, "Way that it has slid out of the loosened grip [m].");
    visit("rest", self.rest, "Way at which it was taken again [m].");
    visit("max_force", self.max_force, "Maximum force between grip and peg [N].");
    visit("held", self.held, "Whether the gripper holds it.");
    visit("air", self.air, "Whether air pushes it.");
    visit("free", self.free, "Whether it was let go altogether.");
    visit("there", self.there, "Whether there is one.");
  }
};

/// A peg as a rigid body between the grip of an arm, which goes where it goes, and what it may touch. All poses are in
/// the frame of the surroundings.
class HeldPeg {
 public:
  /// The peg of a cell at its tube, in the frame of the tube where it really stands.
  HeldPeg(const cell::Cell& cell, const Grip& grip);
  /// @param cell Whose contact it is.
  HeldPeg(const cell::Cell& cell, const PegBody& body, const Grip& grip, std::unique_ptr<PegSurroundings> surroundings);

  /// That resolves the contact with the mass that moves: a peg alone is lighter [s].
  double longest_step() const;
  void place(const Pose& T_peg);
  /// The same in motion: of the bottom centre, and turning [m/s, rad/s].
  void place(const Pose& T_peg, const Vector6& velocity);
  /// It stays behind: nothing is in the grip until it is placed again.
  void leave();
  /// One step while the grip goes to where it would hold the peg so, at that velocity of the peg's bottom and turning.
  void advance(const Pose& held, const Vector6& velocity, double step);
  void hold(bool held, bool air);
  /// The gripper opens altogether and touches it no more.
  void let_go();
  /// What it touches is searched anew, as after a restore.
  void search_anew() { searched_ = 0; }
  HeldPegState state() const { return state_; }
  void restore(const HeldPegState& state);
  const Pose& pose() const { return state_.T; }
  double mass() const { return mass_; }
  /// What the peg does to the grip: force, and torque about the bottom of the held pose [N, N m].
  const Vector6& on_grip() const { return on_grip_; }
  double max_force() const { return state_.max_force; }
  void forget_max_force() { state_.max_force = 0.0; }
  /// The grip still has hold of it, or guides it.
  bool gripped() const { return state_.there && !state_.free && state_.slid < grip_.guide; }
  /// Where the grip holds it, from where it took it.
  const Pose& slip() const { return state_.slip; }
  /// How far the peg has slipped there [m].
  double slipped() const;

 private:
  Eigen::Vector3d off_grip(const Pose& held, const Eigen::Vector3d& arm) const;
  void yield(const Pose& held, const Eigen::Vector3d& arm);
  Vector6 from_grip(const Pose& held, const Vector6& velocity, const Eigen::Vector3d& arm) const;
  Vector6 from_surroundings(double step);
  const force::Contacts& contacts(const Vector6& twist, double step);
  void move(const Vector6& total, double step);

  PegBody body_;
  Grip grip_;
  std::unique_ptr<PegSurroundings> surroundings_;
  physics::EffectiveContact axial_;
  double lateral_, damping_, angular_damping_;
  force::ContactLaw law_, free_law_;
  force::Contacts contacts_;
  int searched_ = 0;  ///< Steps until contacts are searched anew.
  double mass_ = 0.0, held_mass_ = 0.0;
  double inertia_ = 0.0, free_inertia_ = 0.0;
  HeldPegState state_;
  Vector6 on_grip_ = Vector6::Zero();
};

}  // namespace kr5::sim
