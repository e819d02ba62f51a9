// SPDX-License-Identifier: BSD-3-Clause
#include "peg_slide.hpp"

#include <algorithm>
#include <cmath>

#include <kr5/core/error.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/physics/tube.hpp>

namespace kr5::sim {
namespace {

using Eigen::Vector3d;

constexpr double edge_stiffness = 1e7;     // of the touching edges alone, what else gives way is in series [N/m]
constexpr double stiffest = 1e11;          // whose steps are still long enough to end a simulation [N/m]
constexpr double resolving_step = 2.5e-4;  // step that resolves the tool on that stiffness [s]
constexpr double closing_damping = 200.0;  // Hunt-Crossley: a third of critical damping at 15 N [s/m]

Pose slide_along(const Vector3d& axis) { return Pose(rotation_from_z(axis)); }

}  // namespace

PegSlide::PegSlide(const cell::Cell& cell, FrictionBy friction, ContactBy contact, const Vector3d& axis)
    : shape_(physics::peg_tube_shape(cell)),
      T_tube_actual_(physics::T_tube_actual(cell)),
      T_actual_tube_(T_tube_actual_.inverse()),
      R_base_tube_(cell.tube->T_base_tube.linear()),
      axis_(axis),
      contact_(cell),
      friction_by_(friction),
      tool_(cell, cell.tube->T_base_tube * slide_along(axis)) {
  shape_.validate();
  if (contact == ContactBy::Mesh) mesh_.emplace(shape_);
  law_.stiffness = std::max(edge_stiffness, 10.0 / std::max(contact_.depth(1.0), 1e-12));
  require(law_.stiffness <= stiffest, "contact.stiffness: too large for time stepping, found " +
                                          std::to_string(1.0 / contact_.depth(1.0)) + " N/m");
  law_.damping = closing_damping;
  law_.friction = friction == FrictionBy::Contact ? contact_.friction() : 0.0;
}

double PegSlide::longest_step() const { return resolving_step * std::sqrt(edge_stiffness / law_.stiffness); }

Eigen::Vector2d PegSlide::centre(const PegPosture& at) const {
  const Eigen::Vector2d held(at.cx, at.cy);
  if (friction_by_ == FrictionBy::Contact) return held;
  return held + contact_.lateral_displacement(contact_.rolling_friction(at.alpha, at.held));
}

force::Contacts PegSlide::contacts(const Pose& T_tube_peg) {
  return mesh_ ? mesh_->contacts(T_tube_peg) : force::peg_tube_contacts(shape_, T_tube_peg);
}

Vector3d PegSlide::force_on_peg(const PegPosture& at, double step) {
  Pose T_tube_peg = Pose::Identity();
  T_tube_peg.translation() << centre(at), at.cz;
  T_tube_peg.translation() += axis_ * tool_.z();
  T_tube_peg.linear() =
      Eigen::AngleAxisd(at.tilt, Vector3d(-std::sin(at.alpha), std::cos(at.alpha), 0.0)).toRotationMatrix();
  Vector6 twist = Vector6::Zero();
  twist.head<3>() = T_actual_tube_.linear() * axis_ * tool_.speed();
  const Pose T_actual_peg = T_actual_tube_ * T_tube_peg;
  const force::Contacts touching = contacts(T_actual_peg);
  depth_ = touching.depth();
  const force::ContactForce contact = force::contact_wrench(touching, law_, T_actual_peg, twist, step, stiction_);
  Vector3d on_peg = T_tube_actual_.linear() * contact.wrench.head<3>();
  if (friction_by_ == FrictionBy::Contact) return on_peg;
  on_peg.head<2>().setZero();  // the formats have friction alone across the axis
  return on_peg + contact_.rolling_friction(at.alpha, at.held);
}

void PegSlide::advance(const PegPosture& at, double push, double step) {
  tool_.touch(R_base_tube_ * force_on_peg(at, step));
  tool_.push(-push, step);
}

}  // namespace kr5::sim
