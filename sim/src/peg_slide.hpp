// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/force/contact_wrench.hpp>
#include <kr5/physics/contact.hpp>
#include <kr5/sim/mesh_contact.hpp>

#include "held_tool.hpp"

namespace kr5::sim {

/// How the arm holds the peg, and how hard it pushes it along its slide.
struct PegPosture {
  double tilt = 0.0;          ///< [rad]
  double alpha = 0.0;         ///< [rad]
  double cx = 0.0, cy = 0.0;  ///< Peg-bottom centre in T where the slide is at 0 [m].
  double held = 0.0;          ///< [N]
  double cz = 0.0;            ///< The third coordinate of that centre [m].
};

/// The peg of a cell on its tube as both really are: it moves freely along one axis, the arm holds it otherwise.
class PegSlide {
 public:
  /// How friction acts: against the way of the peg's low side, as the formats have it, or as contact and motion say.
  enum class FrictionBy { Formats, Contact };

  /// Needs tool, contact, peg and tube. @param axis Of the slide, a unit vector in T.
  /// @throws InvalidArgument naming the field.
  PegSlide(const cell::Cell& cell, FrictionBy friction, ContactBy contact,
           const Eigen::Vector3d& axis = Eigen::Vector3d::UnitZ());

  /// Longest step that resolves the tool on the contact [s].
  double longest_step() const;
  void place(double z, double speed) { tool_.place(z, speed); }
  /// One step under `push` against the axis [N].
  void advance(const PegPosture& at, double push, double step);

  /// Along the axis [m]; on the one of T this is the height of the bottom centre.
  double z() const { return tool_.z(); }
  double speed() const { return tool_.speed(); }
  double mass() const { return tool_.mass(); }
  /// z as the arm reads it: what gives way under a force lies between it and the peg.
  double reading(double force) const { return tool_.z() + force / law_.stiffness - contact_.depth(force); }
  Vector6 wrench() const { return tool_.wrench(); }
  double depth() const { return depth_; }
  const force::PegTubeShape& shape() const { return shape_; }
  const Pose& tube() const { return T_tube_actual_; }
  /// Where the peg is once the grip has given way to friction.
  Eigen::Vector2d centre(const PegPosture& at) const;
  double stiffness() const { return law_.stiffness; }

 private:
  Eigen::Vector3d force_on_peg(const PegPosture& at, double step);
  force::Contacts contacts(const Pose& T_tube_peg);

  force::PegTubeShape shape_;
  Pose T_tube_actual_, T_actual_tube_;
  Eigen::Matrix3d R_base_tube_;
  Eigen::Vector3d axis_;
  std::optional<MeshContact> mesh_;
  physics::EffectiveContact contact_;
  FrictionBy friction_by_;
  force::ContactLaw law_;
  force::Stiction stiction_;
  HeldTool tool_;
  double depth_ = 0.0;
};

}  // namespace kr5::sim
