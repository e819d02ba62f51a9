// SPDX-License-Identifier: BSD-3-Clause
#include "pile_dynamics.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

namespace kr5::sim {
namespace {

using Eigen::Vector3d;

constexpr double gravity = 9.81;         // [m/s^2]
constexpr int substeps = 4;              // of a step
constexpr double contact_margin = 5e-4;  // at which a contact of slow bodies is foreseen [m]
constexpr double slop = 2e-5;            // overlap that is left alone, so that contacts last [m]
constexpr double push_speed = 0.3;       // at which bodies that overlap part, at most [m/s]
constexpr double bounce_speed = 0.1;     // below which an impact does not bounce [m/s]
constexpr double still_speed = 4e-3;     // below which a body is still [m/s]
constexpr double still_time = 0.1;       // after which a still body sleeps [s]
constexpr double wake_speed = 1e-2;      // of a neighbour at which a sleeping body wakes [m/s]
// Damping of pellets that roll on each other or on the bin; one in the air keeps its speed.
constexpr double rolling_damping = 6.0;  // [1/s]
constexpr double sliding_damping = 0.5;  // [1/s]
constexpr double free_motion = 1.0;      // after which damping begins to grow [s]
constexpr double damping_growth = 10.0;  // [1/s]

double clamped_change(double& sum, double change, double low, double high) {
  const double before = sum;
  sum = std::clamp(before + change, low, high);
  return sum - before;
}

/// The same in every step in which the same parts touch.
std::uint64_t contact_key(int a, int b, int feature) {
  return (static_cast<std::uint64_t>(a) << 40) | (static_cast<std::uint64_t>(b & 0xffffff) << 16) |
         static_cast<std::uint64_t>(feature);
}

}  // namespace

PileDynamics::PileDynamics(const BinShape& bin, const PileOptions& options) : options_(options) {
  planes_ = {{Vector3d::UnitZ(), 0.0},
             {Vector3d::UnitX(), -0.5 * bin.size.x()},
             {-Vector3d::UnitX(), -0.5 * bin.size.x()},
             {Vector3d::UnitY(), -0.5 * bin.size.y()},
             {-Vector3d::UnitY(), -0.5 * bin.size.y()}};
}

void PileDynamics::add(const Pellet& pellet, bool asleep) {
  PileBody body;
  body.shape = {pellet.T_bin_pellet.translation(), pellet.T_bin_pellet.linear(), pellet.radius, 0.5 * pellet.height};
  const double r2 = pellet.radius * pellet.radius, h2 = pellet.height * pellet.height;
  const double mass = options_.density * std::numbers::pi * r2 * pellet.height;
  body.inverse_mass = 1.0 / mass;
  const double across = 12.0 / (mass * (3.0 * r2 + h2));
  body.inverse_inertia = {across, across, 2.0 / (mass * r2)};
  body.asleep = asleep;
  body.quiet = asleep ? still_time : 0.0;
  bodies_.push_back(body);
}

void PileDynamics::remove(int body) {
  bodies_.erase(bodies_.begin() + body);
  remembered_.clear();  // its keys name bodies by number
}

Pellet PileDynamics::pellet(int body) const {
  const CylinderBody& shape = bodies_[static_cast<std::size_t>(body)].shape;
  Pellet out;
  out.T_bin_pellet.translation() = shape.centre;
  out.T_bin_pellet.linear() = shape.rotation;
  out.radius = shape.radius, out.height = 2.0 * shape.half;
  return out;
}

void PileDynamics::wake_neighbours(int body, double margin) {
  const CylinderBody shape = bodies_[static_cast<std::size_t>(body)].shape;
  for (PileBody& other : bodies_)
    if (cylinder_contacts(other.shape, shape, margin).count > 0) other.asleep = false, other.quiet = 0.0;
}

void PileDynamics::hold(int body, const Vector3d& velocity, double force, double torque) {
  grip_ = Grip{body, velocity, force, torque};
  PileBody& held = bodies_[static_cast<std::size_t>(body)];
  held.asleep = false, held.quiet = 0.0;
}

double PileDynamics::inverse_mass(int body) const {
  if (body == nobody || bodies_[static_cast<std::size_t>(body)].asleep) return 0.0;
  return bodies_[static_cast<std::size_t>(body)].inverse_mass;
}

Vector3d PileDynamics::turned(int body, const Vector3d& torque) const {
  if (body == nobody || bodies_[static_cast<std::size_t>(body)].asleep) return Vector3d::Zero();
  return world_inverse_inertia_[static_cast<std::size_t>(body)] * torque;
}

void PileDynamics::add_contact(int a, int b, const CylinderContact& found) {
  Contact& c = contacts_.emplace_back();
  c.a = a, c.b = b >= 0 ? b : nobody;
  c.key = contact_key(a, b, found.feature);
  c.normal = found.normal, c.gap = found.gap;
  c.arm_a = found.point - bodies_[static_cast<std::size_t>(a)].shape.centre;
  c.arm_b = b >= 0 ? Vector3d(found.point - bodies_[static_cast<std::size_t>(b)].shape.centre) : Vector3d::Zero();
}

/// Bodies that move wake those that they touch.
void PileDynamics::wake_touched() {
  const auto fast = [&](const PileBody& body) { return !body.asleep && body.rim_speed() > wake_speed; };
  for (const PileBody& body : bodies_) {
    if (!fast(body)) continue;
    for (PileBody& other : bodies_)
      if (other.asleep && cylinder_contacts(other.shape, body.shape, 1e-4).count > 0)
        other.asleep = false, other.quiet = 0.0;
  }
}

void PileDynamics::find_contacts() {
  contacts_.clear();
  const int count = static_cast<int>(bodies_.size());
  std::vector<double> way(bodies_.size());  // that a body may go in this step, with one step of falling [m]
  for (std::size_t i = 0; i < way.size(); ++i)
    way[i] = bodies_[i].asleep ? 0.0 : 1.5 * (bodies_[i].rim_speed() + gravity * options_.step) * options_.step;
  for (int i = 0; i < count; ++i) {
    const PileBody& a = bodies_[static_cast<std::size_t>(i)];
    const double margin = contact_margin + way[static_cast<std::size_t>(i)];
    if (!a.asleep)
      for (std::size_t p = 0; p < planes_.size(); ++p)
        for (const CylinderContact& found : plane_contacts(a.shape, planes_[p], margin))
          add_contact(i, -1 - static_cast<int>(p), found);
    for (int j = 0; j < i; ++j) {
      const PileBody& b = bodies_[static_cast<std::size_t>(j)];
      if (a.asleep && b.asleep) continue;
      for (const CylinderContact& found :
           cylinder_contacts(a.shape, b.shape, margin + way[static_cast<std::size_t>(j)]))
        add_contact(i, j, found);
    }
  }
}

void PileDynamics::prepare(Contact& c) {
  c.tangent1 = c.normal.unitOrthogonal();
  c.tangent2 = c.normal.cross(c.tangent1);
  const Vector3d* directions[3] = {&c.normal, &c.tangent1, &c.tangent2};
  for (int k = 0; k < 3; ++k) {
    const Vector3d &d = *directions[k], lever_a = c.arm_a.cross(d), lever_b = c.arm_b.cross(d);
    c.turn_a[k] = turned(c.a, lever_a), c.turn_b[k] = turned(c.b, lever_b);
    const double yield = inverse_mass(c.a) + inverse_mass(c.b) + lever_a.dot(c.turn_a[k]) + lever_b.dot(c.turn_b[k]);
    c.mass[k] = yield > 0.0 ? 1.0 / yield : 0.0;
  }
  c.approach = speed_along(c, c.normal);
  const auto before = remembered_.find(c.key);
  if (before == remembered_.end()) return;
  c.impulse[0] = std::max(before->second.dot(c.normal), 0.0);
  c.impulse[1] = before->second.dot(c.tangent1), c.impulse[2] = before->second.dot(c.tangent2);
}

double PileDynamics::speed_along(const Contact& c, const Vector3d& direction) const {
  const PileBody& a = bodies_[static_cast<std::size_t>(c.a)];
  Vector3d relative = a.velocity + a.spin.cross(c.arm_a);
  if (c.b != nobody) {
    const PileBody& b = bodies_[static_cast<std::size_t>(c.b)];
    relative -= b.velocity + b.spin.cross(c.arm_b);
  }
  return relative.dot(direction);
}

void PileDynamics::push_apart(const Contact& c, int axis, double impulse) {
  const Vector3d& direction = axis == 0 ? c.normal : axis == 1 ? c.tangent1 : c.tangent2;
  PileBody& a = bodies_[static_cast<std::size_t>(c.a)];
  a.velocity += impulse * inverse_mass(c.a) * direction;
  a.spin += impulse * c.turn_a[axis];
  if (c.b == nobody) return;
  PileBody& b = bodies_[static_cast<std::size_t>(c.b)];
  b.velocity -= impulse * inverse_mass(c.b) * direction;
  b.spin -= impulse * c.turn_b[axis];
}

void PileDynamics::warm_start() {
  for (const Contact& c : contacts_)
    for (int axis = 0; axis < 3; ++axis) push_apart(c, axis, c.impulse[axis]);
}

/// One round over all contacts. With `push`, overlaps part as springs of 200 Hz, damped ten times beyond the
/// critical, would part them; without, the speed that this left is taken away again.
void PileDynamics::solve(double h, bool push) {
  constexpr double ratio = 10.0;
  const double omega = 2.0 * std::numbers::pi * std::min(200.0, 0.25 / h);
  const double rate = omega / (2.0 * ratio + h * omega), stiff = h * omega * (2.0 * ratio + h * omega);
  for (Contact& c : contacts_) {
    Vector3d parted =
        deltas_[static_cast<std::size_t>(c.a)].shift + deltas_[static_cast<std::size_t>(c.a)].turn.cross(c.arm_a);
    if (c.b != nobody)
      parted -=
          deltas_[static_cast<std::size_t>(c.b)].shift + deltas_[static_cast<std::size_t>(c.b)].turn.cross(c.arm_b);
    const double gap = c.gap + parted.dot(c.normal);
    double bias = 0.0, mass_scale = 1.0, impulse_scale = 0.0;
    if (gap > 0.0) {
      bias = gap / h;
    } else if (push) {
      bias = std::max(rate * std::min(gap + slop, 0.0), -push_speed);
      mass_scale = stiff / (1.0 + stiff), impulse_scale = 1.0 / (1.0 + stiff);
    }
    const double along = speed_along(c, c.normal);
    const double change = clamped_change(
        c.impulse[0], -c.mass[0] * mass_scale * (along + bias) - impulse_scale * c.impulse[0], 0.0, HUGE_VAL);
    c.largest = std::max(c.largest, c.impulse[0]);
    push_apart(c, 0, change);

    const double most = options_.friction * c.impulse[0];
    const double old1 = c.impulse[1], old2 = c.impulse[2];
    c.impulse[1] -= c.mass[1] * speed_along(c, c.tangent1);
    c.impulse[2] -= c.mass[2] * speed_along(c, c.tangent2);
    const double size = std::hypot(c.impulse[1], c.impulse[2]);
    if (size > most) c.impulse[1] *= most / size, c.impulse[2] *= most / size;
    push_apart(c, 1, c.impulse[1] - old1);
    push_apart(c, 2, c.impulse[2] - old2);
  }
}

void PileDynamics::solve_grip(double h) {
  if (!grip_) return;
  PileBody& held = bodies_[static_cast<std::size_t>(grip_->body)];
  const auto limited = [](Vector3d& sum, const Vector3d& change, double most) {
    const Vector3d before = sum;
    sum += change;
    if (sum.norm() > most) sum *= most / sum.norm();
    return Vector3d(sum - before);
  };
  const Vector3d push =
      limited(grip_->impulse, (grip_->velocity - held.velocity) / held.inverse_mass, grip_->force * h);
  held.velocity += push * held.inverse_mass;
  const Eigen::Matrix3d& inverse = world_inverse_inertia_[static_cast<std::size_t>(grip_->body)];
  held.spin += inverse * limited(grip_->twist, -inverse.inverse() * held.spin, grip_->torque * h);
}

void PileDynamics::bounce() {
  for (Contact& c : contacts_) {
    if (c.approach > -bounce_speed || c.largest == 0.0) continue;
    const double change = -c.mass[0] * (speed_along(c, c.normal) + options_.restitution * c.approach);
    push_apart(c, 0, clamped_change(c.impulse[0], change, 0.0, HUGE_VAL));
  }
}

void PileDynamics::integrate(double h) {
  for (PileBody& body : bodies_)
    if (!body.asleep) body.velocity.z() -= gravity * h;
}

void PileDynamics::move(double h) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (bodies_[i].asleep) continue;
    deltas_[i].shift += h * bodies_[i].velocity;
    deltas_[i].turn += h * bodies_[i].spin;
  }
}

void PileDynamics::damp_since(double start) {
  damping_ = 1.0 + damping_growth * std::max(0.0, time_ - start - free_motion);
}

void PileDynamics::step() {
  const double h = options_.step / substeps;
  wake_touched();
  find_contacts();
  world_inverse_inertia_.resize(bodies_.size());
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Eigen::Matrix3d& R = bodies_[i].shape.rotation;
    world_inverse_inertia_[i] = R * bodies_[i].inverse_inertia.asDiagonal() * R.transpose();
  }
  deltas_.assign(bodies_.size(), {});
  for (Contact& c : contacts_) prepare(c);
  for (int k = 0; k < substeps; ++k) {
    integrate(h);
    warm_start();
    if (grip_) grip_->impulse.setZero(), grip_->twist.setZero();
    solve_grip(h);
    solve(h, true);
    move(h);
    solve(h, false);
    solve_grip(h);
  }
  bounce();
  finish_step();
}

void PileDynamics::finish_step() {
  std::vector<bool> touches(bodies_.size(), false);
  remembered_.clear();
  for (const Contact& c : contacts_) {
    if (c.impulse[0] == 0.0) continue;
    remembered_[c.key] = c.impulse[0] * c.normal + c.impulse[1] * c.tangent1 + c.impulse[2] * c.tangent2;
    touches[static_cast<std::size_t>(c.a)] = true;
    if (c.b != nobody) touches[static_cast<std::size_t>(c.b)] = true;
  }
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    PileBody& body = bodies_[i];
    if (body.asleep) continue;
    body.shape.centre += deltas_[i].shift;
    body.shape.rotation = nearest_rotation(exp_rotation(deltas_[i].turn) * body.shape.rotation);
    if (touches[i]) {
      body.velocity *= std::exp(-damping_ * sliding_damping * options_.step);
      body.spin *= std::exp(-damping_ * rolling_damping * options_.step);
    }
    const bool held = grip_ && grip_->body == static_cast<int>(i);
    body.quiet = body.rim_speed() < still_speed && touches[i] && !held ? body.quiet + options_.step : 0.0;
    if (body.quiet < still_time) continue;
    body.asleep = true;
    body.velocity.setZero(), body.spin.setZero();
  }
  time_ += options_.step;
}

Vector6 PileDynamics::grip_wrench() const {
  Vector6 out = Vector6::Zero();
  if (grip_) out << grip_->impulse, grip_->twist;
  return out * (substeps / options_.step);
}

bool PileDynamics::alone(int body, double margin) const {
  const CylinderBody& shape = bodies_[static_cast<std::size_t>(body)].shape;
  for (const PlaneBody& plane : planes_)
    if (plane_contacts(shape, plane, margin).count > 0) return false;
  for (int i = 0; i < static_cast<int>(bodies_.size()); ++i)
    if (i != body && cylinder_contacts(bodies_[static_cast<std::size_t>(i)].shape, shape, margin).count > 0)
      return false;
  return true;
}

PileMotion PileDynamics::motion() const {
  PileMotion out;
  out.time = time_;
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    out.bodies.push_back(
        {pellet(static_cast<int>(i)), bodies_[i].velocity, bodies_[i].spin, bodies_[i].quiet, bodies_[i].asleep});
  for (const auto& [key, impulse] : remembered_)
    out.impulses.push_back(
        {static_cast<int>(key >> 40), static_cast<int>(key >> 16 & 0xffffff), static_cast<int>(key & 0xffff), impulse});
  std::sort(out.impulses.begin(), out.impulses.end(), [](const PileImpulse& a, const PileImpulse& b) {
    return std::tie(a.body, a.other, a.feature) < std::tie(b.body, b.other, b.feature);
  });
  return out;
}

void PileDynamics::restore(const PileMotion& motion) {
  bodies_.clear(), contacts_.clear(), remembered_.clear();
  grip_.reset();
  for (const PileBodyMotion& from : motion.bodies) {
    add(from.pellet, from.asleep);
    PileBody& body = bodies_.back();
    body.velocity = from.velocity, body.spin = from.spin, body.quiet = from.quiet;
  }
  for (const PileImpulse& i : motion.impulses) remembered_[contact_key(i.body, i.other, i.feature)] = i.impulse;
  time_ = motion.time;
}

bool PileDynamics::at_rest() const {
  return std::all_of(bodies_.begin(), bodies_.end(), [](const PileBody& body) { return body.asleep; });
}

PileState PileDynamics::state() const {
  PileState out;
  out.at_rest = at_rest(), out.time = time_;
  for (const PileBody& body : bodies_) {
    const Vector3d spin = body.shape.rotation.transpose() * body.spin;
    out.speed = std::max(out.speed, body.rim_speed());
    out.kinetic_energy += 0.5 * (body.velocity.squaredNorm() / body.inverse_mass +
                                 spin.cwiseAbs2().cwiseQuotient(body.inverse_inertia).sum());
  }
  return out;
}

}  // namespace kr5::sim
