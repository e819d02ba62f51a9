// SPDX-License-Identifier: BSD-3-Clause
#include "held_peg.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <kr5/physics/contact.hpp>
#include <kr5/physics/tube.hpp>

namespace kr5::sim {
namespace {

using Eigen::Vector3d;

constexpr double steel = 7850.0;         // [kg/m^3]
constexpr double fingers = 0.25;         // that move with a held peg [kg]
constexpr double local_stiffness = 2e6;  // of the touching edges, what else gives way is in series [N/m]
constexpr double closing = 4.0;          // Hunt-Crossley, so little that 100 N of it are still resolved [s/m]
constexpr double damped = 0.5;           // of critical, across and about the grip
constexpr double resolved = 2e-4;        // step that resolves peg and fingers on that stiffness [s]
constexpr int steps_a_search = 3;        // in 0.6 ms nothing new is touched deeply
constexpr double guiding = 0.5;          // of its stiffness is left of a grip that lets slide
constexpr double air_gap = 2e-4;         // above the highest point of contact nothing is looked for [m]

/// Rotation vector of a small rotation, to third order.
Vector3d turn_between(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to) {
  const Eigen::Matrix3d R = to * from.transpose();
  return 0.5 * Vector3d(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
}

}  // namespace

HeldPeg::HeldPeg(const cell::Cell& cell, const Grip& grip)
    : shape_(physics::peg_tube_shape(cell)), grip_(grip), axial_(cell) {
  shape_.validate();
  const double r = shape_.peg_radius, l = shape_.peg_length;
  mass_ = steel * std::numbers::pi * r * r * l;
  held_mass_ = mass_ + fingers;
  const double across = held_mass_ * (3 * r * r + l * l) / 12;
  inertia_.setConstant(across);  // the fingers make up for what a peg lacks about its axis
  lateral_ = 1.0 / (1.0 / grip.lateral + axial_.lateral_compliance());
  damping_ = 2 * damped * std::sqrt(lateral_ * held_mass_);
  const double about = across + held_mass_ * std::pow(grip.height - 0.5 * l, 2);
  angular_damping_ = 2 * damped * std::sqrt(grip.angular * about);
  law_ = {local_stiffness, closing, axial_.friction(), 0.3 * local_stiffness, 100.0};
}

double HeldPeg::longest_step() const { return held_ ? resolved : 0.4 * resolved; }

void HeldPeg::place(const Pose& T_tube_peg) {
  T_ = T_tube_peg;
  v_ = w_ = Vector3d::Zero();
  stiction_ = {};
  slid_ = rest_ = 0.0;
  searched_ = 0;
  held_ = there_ = true;
  air_ = false;
}

void HeldPeg::leave() {
  there_ = false;
  on_grip_.setZero();
}

void HeldPeg::hold(bool held, bool air) {
  if (held && !held_) rest_ = slid_;  // it is taken where it has slid to
  held_ = held;
  air_ = air;
}

/// Force and torque about the peg's centre of mass; `arm` leads from there to the place of the grip on the peg.
Vector6 HeldPeg::from_grip(const Pose& held, const Vector6& velocity, const Vector3d& arm) const {
  const Vector3d axis = held.linear().col(2), up = grip_.height * axis;
  const Vector3d off =
      held.translation() + up - (T_.translation() + 0.5 * shape_.peg_length * T_.linear().col(2) + arm);
  const Vector3d omega = T_.linear() * w_;
  const Vector3d drift = velocity.head<3>() + velocity.tail<3>().cross(up) - v_ - omega.cross(arm);
  const double along = axis.dot(off), pressed = rest_ - along;  // a peg pushed up into its grip presses on it
  const double share = held_ ? 1.0 : guiding;
  Vector3d force = share * (lateral_ * (off - along * axis) + damping_ * (drift - axis.dot(drift) * axis));
  if (held_) {
    const double speed = -axis.dot(drift);
    const double size = pressed > 0 ? axial_.force(pressed, speed) : -axial_.force(-pressed, -speed);
    force -= size * axis;
  }
  Vector6 out;
  out << force, arm.cross(force) + share * (grip_.angular * turn_between(T_.linear(), held.linear()) +
                                            angular_damping_ * (velocity.tail<3>() - omega));
  return out;
}

/// Where the peg touches. Between two searches the contacts move as the peg does: the way in between is micrometres.
const force::Contacts& HeldPeg::touching(const Vector6& twist, double step) {
  const double lean = std::hypot(T_.linear()(0, 2), T_.linear()(1, 2));
  if (T_.translation().z() > shape_.peg_radius * lean + air_gap) {
    contacts_.count = searched_ = 0;
    return contacts_;
  }
  if (searched_-- <= 0) {
    searched_ = steps_a_search - 1;
    return contacts_ = force::peg_tube_contacts(shape_, T_);
  }
  int kept = 0;
  for (int i = 0; i < contacts_.count; ++i) {
    force::ContactPoint c = contacts_.points[static_cast<std::size_t>(i)];
    const Vector3d way = step * (twist.head<3>() + twist.tail<3>().cross(c.point - T_.translation()));
    c.depth -= c.normal.dot(way);
    if (c.depth > 0) contacts_.points[static_cast<std::size_t>(kept++)] = c;
  }
  contacts_.count = kept;
  return contacts_;
}

/// Force and torque about the peg's bottom centre.
Vector6 HeldPeg::from_tube(double step) {
  Vector6 twist;
  const Vector3d omega = T_.linear() * w_;
  twist << v_ - omega.cross(0.5 * shape_.peg_length * T_.linear().col(2)), omega;
  return force::contact_wrench(touching(twist, step), law_, T_, twist, step, stiction_).wrench;
}

void HeldPeg::advance(const Pose& held, const Vector6& velocity, double step) {
  if (!there_) return;
  const Vector3d half = 0.5 * shape_.peg_length * T_.linear().col(2);
  const Vector3d arm = (grip_.height - 0.5 * shape_.peg_length) * T_.linear().col(2);
  const Vector6 touch = from_tube(step);
  Vector6 total;
  total << touch.head<3>(), touch.tail<3>() - half.cross(touch.head<3>());
  Vector6 grip = Vector6::Zero();
  if (gripped()) grip = from_grip(held, velocity, arm);
  total += grip;
  if (!held_) {
    total.head<3>() += mass_ * grip_.gravity;
    if (air_) total.head<3>() -= grip_.air * T_.linear().col(2);
    slid_ = std::max(slid_, held.linear().col(2).dot(held.translation() - T_.translation()));
  }
  const double mass = held_ ? held_mass_ : mass_;
  const Vector3d inertia = mass / held_mass_ * inertia_;
  v_ += step / mass * total.head<3>();
  const Vector3d torque = T_.linear().transpose() * total.tail<3>();
  w_ += step * (torque - w_.cross(inertia.cwiseProduct(w_))).cwiseQuotient(inertia);
  const Vector3d centre = T_.translation() + half + step * v_;
  T_.linear() = T_.linear() * exp_rotation(step * w_);
  T_.translation() = centre - 0.5 * shape_.peg_length * T_.linear().col(2);
  const Vector3d at = T_.translation() + half + arm;
  on_grip_ << -grip.head<3>(),
      -(grip.tail<3>() - arm.cross(grip.head<3>())) - (at - held.translation()).cross(grip.head<3>());
  if (!held_) {  // the sensor misses its weight
    const Vector3d weight = mass_ * grip_.gravity, middle = 0.5 * shape_.peg_length * held.linear().col(2);
    on_grip_.head<3>() -= weight;
    on_grip_.tail<3>() -= middle.cross(weight);
  }
  greatest_ = std::max(greatest_, grip.head<3>().norm());
}

}  // namespace kr5::sim
