// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/force/contact_wrench.hpp>

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include <kr5/core/error.hpp>

namespace kr5::force {
namespace {

using Eigen::Vector3d;

/// Sums over the contacts; positions from the bottom centre.
struct Sums {
  double normal = 0.0;
  Vector3d force = Vector3d::Zero(), torque = Vector3d::Zero();
  Vector3d centre = Vector3d::Zero(), speed = Vector3d::Zero();  // weighted by force
};

Sums sum_up(const Contacts& contacts, const ContactLaw& law, const Vector3d& origin, const Vector6& twist,
            std::array<double, Contacts::capacity>& force) noexcept {
  Sums s;
  double share = 0;
  for (const ContactPoint& c : contacts) share += c.weight * c.depth;
  const double scale = law.stiffness * contacts.depth() / share;
  for (int i = 0; i < contacts.count; ++i) {
    const ContactPoint& c = contacts.points[static_cast<std::size_t>(i)];
    const Vector3d arm = c.point - origin, v = twist.head<3>() + twist.tail<3>().cross(arm);
    const double f = scale * c.weight * c.depth * std::max(0.0, 1 - law.damping * c.normal.dot(v));
    force[static_cast<std::size_t>(i)] = f;
    s.normal += f;
    s.force += f * c.normal;
    s.torque += f * arm.cross(c.normal);
    s.centre += f * arm;
    s.speed += f * (v - c.normal * c.normal.dot(v));
  }
  if (s.normal > 0) s.centre /= s.normal, s.speed /= s.normal;
  return s;
}

/// Spring that yields: moves `strain` on, holds it at the limit, and gives its force.
template <class Value>
Value yield(Value& strain, const Value& speed, double dt, double stiffness, double damping, double limit,
            bool* sliding) noexcept {
  const auto size = [](const Value& x) {
    if constexpr (std::is_same_v<Value, double>)
      return std::abs(x);
    else
      return x.norm();
  };
  strain = strain + speed * dt;
  const double most = limit / stiffness;
  if (size(strain) > most) strain = strain * (most / size(strain)), *sliding = true;
  const Value force = -(stiffness * strain + damping * speed);
  return size(force) > limit ? Value(force * (limit / size(force))) : force;
}

}  // namespace

void ContactLaw::validate() const {
  require(stiffness > 0, "stiffness must be positive [N/m]");
  require(damping >= 0, "damping must not be negative [s/m]");
  require(friction >= 0, "friction must not be negative [-]");
  require(tangential_stiffness > 0, "tangential_stiffness must be positive [N/m]");
  require(tangential_damping >= 0, "tangential_damping must not be negative [N s/m]");
}

ContactForce contact_wrench(const Contacts& contacts, const ContactLaw& law, const Pose& T_tube_peg,
                            const Vector6& twist, double dt, Stiction& stiction) noexcept {
  ContactForce out;
  std::array<double, Contacts::capacity> force;
  const Sums s = contacts.count > 0 ? sum_up(contacts, law, T_tube_peg.translation(), twist, force) : Sums{};
  if (!(s.normal > 0)) {
    stiction = {};
    return out;
  }
  out.normal = s.normal;
  out.wrench << s.force, s.torque;
  const double limit = law.friction * s.normal;
  const Vector3d axis = s.force.normalized();
  stiction.slip -= axis * axis.dot(stiction.slip);  // the contact may have turned since
  const Vector3d drag = yield<Vector3d>(stiction.slip, s.speed, dt, law.tangential_stiffness, law.tangential_damping,
                                        limit, &out.sliding);
  double arm = 0;
  for (int i = 0; i < contacts.count; ++i) {
    const ContactPoint& c = contacts.points[static_cast<std::size_t>(i)];
    const Vector3d from = c.point - T_tube_peg.translation();
    const Vector3d part = force[static_cast<std::size_t>(i)] / s.normal * (drag - c.normal * c.normal.dot(drag));
    out.wrench.head<3>() += part;
    out.wrench.tail<3>() += from.cross(part);
    arm += force[static_cast<std::size_t>(i)] / s.normal * axis.cross(from - s.centre).norm();
  }
  out.friction = drag.norm();
  if (arm > 0) {
    bool turning = false;
    const double turn = axis.dot(twist.tail<3>());
    const double torque = yield<double>(stiction.spin, turn, dt, law.tangential_stiffness * arm * arm,
                                        law.tangential_damping * arm * arm, limit * arm, &turning);
    out.wrench.tail<3>() += torque * axis;
  } else {
    stiction.spin = 0;
  }
  return out;
}

}  // namespace kr5::force
