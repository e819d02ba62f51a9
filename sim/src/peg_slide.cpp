// SPDX-License-Identifier: BSD-3-Clause
#include "peg_slide.hpp"

#include <algorithm>
#include <cmath>

#include "effective.hpp"

namespace kr5::sim {
namespace {

using Eigen::Vector3d;

constexpr double local_stiffness = 1e7;  // of the touching edges alone, what else gives way is in series [N/m]
constexpr double resolved = 2.5e-4;      // step that resolves the tool on that stiffness [s]
constexpr double closing = 200.0;        // Hunt-Crossley: a third of critical damping at 15 N [s/m]

Pose slide_along(const Vector3d& axis) {
  return Pose(Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), axis).toRotationMatrix());
}

}  // namespace

PegSlide::PegSlide(const cell::Cell& cell, FrictionBy friction, ContactBy contact, const Vector3d& axis)
    : shape_(real_shape(cell)),
      T_T_tube_(predict::real_tube(cell.effects.task)),
      T_tube_T_(T_T_tube_.inverse()),
      R_B_T_(cell.tube->T_B_T.linear()),
      axis_(axis),
      contact_(cell),
      lateral_(cell.effects.task.lateral),
      friction_by_(friction),
      tool_(cell, cell.tube->T_B_T * slide_along(axis)) {
  shape_.validate();
  if (contact == ContactBy::Mesh) mesh_.emplace(shape_);
  law_.stiffness = std::max(local_stiffness, 10.0 / std::max(contact_.depth(1.0), 1e-12));
  law_.damping = closing;
  law_.friction = friction == FrictionBy::Contact ? contact_.friction() : 0.0;
}

double PegSlide::longest_step() const { return resolved * std::sqrt(local_stiffness / law_.stiffness); }

Eigen::Vector2d PegSlide::centre(const PegPosture& at) const {
  const Eigen::Vector2d held(at.cx, at.cy);
  return friction_by_ == FrictionBy::Formats ? Eigen::Vector2d(held + lateral_ * friction(at).head<2>()) : held;
}

Vector3d PegSlide::friction(const PegPosture& at) const {
  return contact_.friction() * at.held * Vector3d(std::sin(at.alpha), -std::cos(at.alpha), 0.0);
}

force::Contacts PegSlide::contacts(const Pose& T_tube_peg) {
  return mesh_ ? mesh_->contacts(T_tube_peg) : force::peg_tube_contacts(shape_, T_tube_peg);
}

Vector3d PegSlide::force_on_peg(const PegPosture& at, double step) {
  Pose T_T_peg = Pose::Identity();
  T_T_peg.translation() << centre(at), at.cz;
  T_T_peg.translation() += axis_ * tool_.z();
  T_T_peg.linear() =
      Eigen::AngleAxisd(at.tilt, Vector3d(-std::sin(at.alpha), std::cos(at.alpha), 0.0)).toRotationMatrix();
  Vector6 twist = Vector6::Zero();
  twist.head<3>() = T_tube_T_.linear() * axis_ * tool_.speed();
  const Pose T_tube_peg = T_tube_T_ * T_T_peg;
  const force::Contacts touching = contacts(T_tube_peg);
  depth_ = touching.depth();
  const force::ContactForce contact = force::contact_wrench(touching, law_, T_tube_peg, twist, step, stiction_);
  Vector3d on_peg = T_T_tube_.linear() * contact.wrench.head<3>();
  if (friction_by_ == FrictionBy::Contact) return on_peg;
  on_peg.head<2>().setZero();  // the formats have friction alone across the axis
  return on_peg + friction(at);
}

void PegSlide::advance(const PegPosture& at, double push, double step) {
  tool_.touch(R_B_T_ * force_on_peg(at, step));
  tool_.push(-push, step);
}

}  // namespace kr5::sim
