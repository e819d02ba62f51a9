// SPDX-License-Identifier: BSD-3-Clause
#include "held_peg.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <kr5/physics/contact.hpp>
#include <kr5/physics/tube.hpp>

namespace kr5::sim {
namespace {

using Eigen::Vector3d;

constexpr double fingers = 0.25;                  // that move with a held peg [kg]
constexpr double local_stiffness = 2e6;           // of the touching edges, what else gives way is in series [N/m]
constexpr double closing = 4.0;                   // Hunt-Crossley, so little that 100 N of it are still resolved [s/m]
constexpr double damped = 0.5;                    // of critical, across and about the grip
constexpr double resolved = 2e-4;                 // step that resolves peg and fingers on that stiffness [s]
constexpr double slid_resolved = 0.4 * resolved;  // the same of a peg that slides alone, which is lighter [s]
constexpr double free_resolved = 4e-5;            // of one that was let go, on a contact so soft that it [s]
constexpr double free_angle = 0.1;                // oscillates in a step by this [rad]
constexpr double free_closing = 20.0;             // so that what falls comes to rest after few impacts [s/m]
constexpr double free_drag = 900.0;  // friction of such a peg while it sticks, over speed and mass, at most [1/s]
constexpr int steps_a_search = 3;    // in 0.6 ms nothing new is touched deeply
constexpr double guiding = 0.5;      // of its stiffness is left of a grip that lets slide
constexpr double air_gap = 2e-4;     // above the highest point of contact nothing is looked for [m]

/// Rotation vector of a small rotation, to third order.
Vector3d turn_between(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to) {
  const Eigen::Matrix3d R = to * from.transpose();
  return 0.5 * Vector3d(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
}

class TubeSurroundings : public PegSurroundings {
 public:
  explicit TubeSurroundings(const force::PegTubeShape& shape) : shape_(shape) { shape_.validate(); }
  bool clear(const Pose& T_tube_peg) const override {
    const double lean = std::hypot(T_tube_peg.linear()(0, 2), T_tube_peg.linear()(1, 2));
    return T_tube_peg.translation().z() > shape_.peg_radius * lean + air_gap;
  }
  force::Contacts contacts(const Pose& T_tube_peg) const override {
    return force::peg_tube_contacts(shape_, T_tube_peg);
  }

 private:
  force::PegTubeShape shape_;
};

}  // namespace

HeldPeg::HeldPeg(const cell::Cell& cell, const Grip& grip)
    : HeldPeg(cell, {.radius = cell.peg->radius, .length = cell.peg->length}, grip,
              std::make_unique<TubeSurroundings>(physics::peg_tube_shape(cell))) {}

HeldPeg::HeldPeg(const cell::Cell& cell, const PegBody& body, const Grip& grip,
                 std::unique_ptr<PegSurroundings> surroundings)
    : body_(body), grip_(grip), surroundings_(std::move(surroundings)), axial_(cell) {
  const double r = body_.radius, l = body_.length;
  mass_ = body_.density * std::numbers::pi * r * r * l;
  held_mass_ = mass_ + fingers;
  const double across = held_mass_ * (3 * r * r + l * l) / 12;
  inertia_ = grip.inertia > 0 ? grip.inertia : across;  // the fingers make up for what a peg lacks about its axis
  free_inertia_ = mass_ * (3 * r * r + l * l) / 12;
  lateral_ = 1.0 / (1.0 / grip.lateral + axial_.lateral_compliance());
  damping_ = 2 * damped * std::sqrt(lateral_ * held_mass_);
  const double about = inertia_ + held_mass_ * std::pow(grip.height - 0.5 * l, 2);
  angular_damping_ = 2 * damped * std::sqrt(grip.angular * about);
  law_ = free_law_ = {local_stiffness, closing, axial_.friction(), 0.3 * local_stiffness, 100.0};
  free_law_.stiffness = std::min(local_stiffness, mass_ * std::pow(free_angle / free_resolved, 2));
  free_law_.damping = free_closing;
  free_law_.tangential_stiffness = 0.3 * free_law_.stiffness;
  free_law_.tangential_damping = std::min(100.0, free_drag * mass_);
}

double HeldPeg::longest_step() const {
  if (state_.free) return free_resolved;
  return state_.held ? resolved : slid_resolved;
}

void HeldPeg::place(const Pose& T_peg) { place(T_peg, Vector6::Zero()); }

void HeldPeg::place(const Pose& T_peg, const Vector6& velocity) {
  state_ = {.T = T_peg, .max_force = state_.max_force};
  state_.v = velocity.head<3>() + velocity.tail<3>().cross(0.5 * body_.length * T_peg.linear().col(2));
  state_.w = T_peg.linear().transpose() * velocity.tail<3>();
  searched_ = 0;
}

void HeldPeg::leave() {
  state_.there = false;
  on_grip_.setZero();
}

void HeldPeg::let_go() {
  state_.held = false;
  state_.free = true;
}

void HeldPeg::restore(const HeldPegState& state) {
  state_ = state;
  searched_ = 0;
}

void HeldPeg::hold(bool held, bool air) {
  if (held && !state_.held) state_.rest = state_.slid;  // it is taken where it has slid to
  state_.held = held;
  state_.air = air;
}

double HeldPeg::slipped() const {
  const Vector3d at(0, 0, grip_.height);
  return (state_.slip * at - at).norm();
}

/// From the place of the grip on the peg to where the grip holds it; `arm` leads to that place from the centre of mass.
Vector3d HeldPeg::off_grip(const Pose& held, const Vector3d& arm) const {
  return held.translation() + grip_.height * held.linear().col(2) -
         (state_.T.translation() + 0.5 * body_.length * state_.T.linear().col(2) + arm);
}

/// The grip takes the peg further along where its springs would hold more than it can.
void HeldPeg::yield(const Pose& held, const Vector3d& arm) {
  if (!state_.held || !(std::isfinite(grip_.force) || std::isfinite(grip_.torque))) return;
  Pose target = held * state_.slip;
  const Vector3d axis = target.linear().col(2), off = off_grip(target, arm), support = held.linear() * grip_.support;
  const double along = axis.dot(off);
  const Vector3d across = off - along * axis;
  const Vector3d spring = lateral_ * across + std::copysign(axial_.force(std::abs(along), 0.0), along) * axis;
  const double backed = std::max(spring.dot(support), 0.0);
  const double size = (spring - backed * support).norm();
  Vector3d shift = Vector3d::Zero();
  if (size > grip_.force)
    shift = (grip_.force / size - 1) * (backed > 0 ? Vector3d(off - support.dot(off) * support) : off);
  const Vector3d turn = turn_between(state_.T.linear(), target.linear());
  const double torque = grip_.angular * turn.norm();
  const Vector3d at(0, 0, grip_.height);
  const Vector3d point = target * at + shift;
  if (torque > grip_.torque)
    target.linear() = exp_rotation((grip_.torque / torque - 1) * turn) * target.linear();
  else if (shift.isZero(0))
    return;
  target.translation() = point - target.linear() * at;
  state_.slip = held.inverse() * target;
  state_.slip.linear() = nearest_rotation(state_.slip.linear());
}

/// Force and torque about the peg's centre of mass; `arm` leads from there to the place of the grip on the peg.
Vector6 HeldPeg::from_grip(const Pose& held, const Vector6& velocity, const Vector3d& arm) const {
  const Vector3d axis = held.linear().col(2), up = grip_.height * axis;
  const Vector3d off = off_grip(held, arm);
  const Vector3d omega = state_.T.linear() * state_.w;
  const Vector3d drift = velocity.head<3>() + velocity.tail<3>().cross(up) - state_.v - omega.cross(arm);
  const double along = axis.dot(off), pressed = state_.rest - along;  // a peg pushed up into its grip presses on it
  const double share = state_.held ? 1.0 : guiding;
  Vector3d force = share * (lateral_ * (off - along * axis) + damping_ * (drift - axis.dot(drift) * axis));
  if (state_.held) {
    const double speed = -axis.dot(drift);
    const double size = pressed > 0 ? axial_.force(pressed, speed) : -axial_.force(-pressed, -speed);
    force -= size * axis;
  }
  Vector6 out;
  out << force, arm.cross(force) + share * (grip_.angular * turn_between(state_.T.linear(), held.linear()) +
                                            angular_damping_ * (velocity.tail<3>() - omega));
  return out;
}

/// Where the peg touches. Between two searches the contacts move as the peg does: the way in between is micrometres.
const force::Contacts& HeldPeg::contacts(const Vector6& twist, double step) {
  if (surroundings_->clear(state_.T)) {
    contacts_.count = searched_ = 0;
    return contacts_;
  }
  if (state_.free || searched_-- <= 0) {
    searched_ = steps_a_search - 1;
    return contacts_ = surroundings_->contacts(state_.T);
  }
  int kept = 0;
  for (int i = 0; i < contacts_.count; ++i) {
    force::ContactPoint c = contacts_.points[static_cast<std::size_t>(i)];
    const Vector3d way = step * (twist.head<3>() + twist.tail<3>().cross(c.point - state_.T.translation()));
    c.depth -= c.normal.dot(way);
    if (c.depth > 0) contacts_.points[static_cast<std::size_t>(kept++)] = c;
  }
  contacts_.count = kept;
  return contacts_;
}

/// Force and torque about the peg's bottom centre.
Vector6 HeldPeg::from_surroundings(double step) {
  Vector6 twist;
  const Vector3d omega = state_.T.linear() * state_.w;
  twist << state_.v - omega.cross(0.5 * body_.length * state_.T.linear().col(2)), omega;
  const force::ContactLaw& law = state_.free ? free_law_ : law_;
  return force::contact_wrench(contacts(twist, step), law, state_.T, twist, step, state_.stiction).wrench;
}

void HeldPeg::move(const Vector6& total, double step) {
  const double mass = state_.held ? held_mass_ : mass_;
  const double inertia = state_.held ? inertia_ : free_inertia_;
  const Vector3d half = 0.5 * body_.length * state_.T.linear().col(2);
  state_.v += step / mass * total.head<3>();
  state_.w += step / inertia * (state_.T.linear().transpose() * total.tail<3>());
  if (state_.free && contacts_.count > 0) {
    const double left = std::exp(-grip_.settling * step);
    state_.v *= left;
    state_.w *= left;
  }
  const Vector3d centre = state_.T.translation() + half + step * state_.v;
  state_.T.linear() = state_.T.linear() * exp_rotation(step * state_.w);
  state_.T.translation() = centre - 0.5 * body_.length * state_.T.linear().col(2);
}

void HeldPeg::advance(const Pose& held, const Vector6& velocity, double step) {
  if (!state_.there) return;
  const Vector3d half = 0.5 * body_.length * state_.T.linear().col(2);
  const Vector3d arm = (grip_.height - 0.5 * body_.length) * state_.T.linear().col(2);
  const Vector6 touch = from_surroundings(step);
  Vector6 total;
  total << touch.head<3>(), touch.tail<3>() - half.cross(touch.head<3>());
  Vector6 grip = Vector6::Zero();
  if (gripped()) {
    yield(held, arm);
    grip = from_grip(held * state_.slip, velocity, arm);
  }
  total += grip;
  if (!state_.held || grip_.carried) total.head<3>() += mass_ * grip_.gravity;
  if (!state_.held) {
    if (state_.air) total.head<3>() -= grip_.air * state_.T.linear().col(2);
    state_.slid = std::max(state_.slid, held.linear().col(2).dot(held.translation() - state_.T.translation()));
  }
  move(total, step);
  const Vector3d at = state_.T.translation() + half + arm;
  on_grip_ << -grip.head<3>(),
      -(grip.tail<3>() - arm.cross(grip.head<3>())) - (at - held.translation()).cross(grip.head<3>());
  if (!state_.held && !grip_.carried) {  // the sensor misses its weight
    const Vector3d weight = mass_ * grip_.gravity, middle = 0.5 * body_.length * held.linear().col(2);
    on_grip_.head<3>() -= weight;
    on_grip_.tail<3>() -= middle.cross(weight);
  }
  state_.max_force = std::max(state_.max_force, grip.head<3>().norm());
}

}  // namespace kr5::sim
