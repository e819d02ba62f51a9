// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/joint_drive.hpp>

#include <cmath>

namespace kr5::physics {

using Eigen::Index;
using Eigen::VectorXd;

double encoder_offset(const cell::Cell& cell, int joint) {
  return cell.effects.number("encoder_offset", "offset", joint);
}

double transmission_error(const Transmission& t, double q) {
  return t.uniform() ? 0.0 : t.amplitude * std::sin(t.cycles * q + t.phase);
}

Transmission::Transmission(const cell::Cell& cell, int joint) : encoder_offset(physics::encoder_offset(cell, joint)) {
  amplitude = cell.effects.number("transmission_error", "amplitude", joint);
  cycles = cell.effects.number("transmission_error", "cycles", joint);
  phase = cell.effects.number("transmission_error", "phase", joint);
}

double Transmission::link(double q) const { return q + encoder_offset + transmission_error(*this, q); }

double Transmission::slope(double q) const {
  return uniform() ? 1.0 : 1.0 + amplitude * cycles * std::cos(cycles * q + phase);
}

double Transmission::curvature(double q) const {
  return uniform() ? 0.0 : -amplitude * cycles * cycles * std::sin(cycles * q + phase);
}

double cable_spring(const CableSpring& cable, double q) { return cable.stiffness * (q - cable.rest); }

template <class Value>
Value torque_ripple(const TorqueRipple& ripple, const Value& q) {
  using std::sin;
  return ripple.amplitude * sin(ripple.cycles * q + ripple.phase);
}
template double torque_ripple(const TorqueRipple&, const double&);
template Eigen::ArrayXd torque_ripple(const TorqueRipple&, const Eigen::ArrayXd&);

JointDrive::JointDrive(const cell::Cell& cell, int joint)
    : friction(cell, joint), spring(gear_spring(cell, joint)), transmission(cell, joint) {
  const cell::Effects& e = cell.effects;
  cable = {e.number("cable_spring", "stiffness", joint), e.number("cable_spring", "rest", joint)};
  ripple = {e.number("torque_ripple", "amplitude", joint), e.number("torque_ripple", "cycles", joint),
            e.number("torque_ripple", "phase", joint)};
}

std::vector<JointDrive> joint_drives(const cell::Cell& cell) {
  std::vector<JointDrive> out;
  for (int i = 0; i < cell.robot.joints(); ++i) out.emplace_back(cell, i);
  return out;
}

VectorXd links_at_rest(const std::vector<JointDrive>& joints, const VectorXd& reading, RestRule rule,
                       const GravityTorque& gravity) {
  VectorXd rigid(reading.size());
  bool gives_way = false;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const auto k = static_cast<Index>(i);
    rigid[k] = joints[i].transmission.link(reading[k]);
    gives_way |= !joints[i].spring.rigid();
  }
  if (!gives_way) return rigid;
  VectorXd out = rigid;
  constexpr int passes = 3;  // the sag moves gravity by a part of itself that is tiny
  for (int pass = 0; pass < passes; ++pass) {
    const VectorXd held = gravity(out);
    for (std::size_t i = 0; i < joints.size(); ++i) {
      const auto k = static_cast<Index>(i);
      const GearSpring& spring = joints[i].spring;
      const double torque = held[k] + cable_spring(joints[i].cable, out[k]);
      out[k] = rigid[k] - (rule == RestRule::Static ? spring.lead_at_rest(torque) : spring.lead_in_balance(torque));
    }
  }
  return out;
}

}  // namespace kr5::physics
