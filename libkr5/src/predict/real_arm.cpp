// SPDX-License-Identifier: BSD-3-Clause
#include "predict/real_arm.hpp"

#include <cmath>

namespace kr5::predict {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double elastic_damping = 0.06;
constexpr double backlash_damping = 0.3;
/// Stiffness of the gear behind the free play [N m/rad]; joints beyond the sixth are as the sixth.
constexpr std::array<double, 6> gear_stiffness = {8e5, 8e5, 4e5, 8e4, 5e4, 3e4};
/// Less gravity torque than this leaves a link in the middle of the play [N m].
constexpr double side_torque = 0.5;

}  // namespace

RealArm::RealArm(const cell::Cell& cell) : cell_(cell) {
  for (int i = 0; i < joints(); ++i) {
    const cell::JointEffects& e = cell.effects.joint(i);
    if (std::isfinite(e.elasticity))
      soft_.push_back({i, e.elasticity, e.backlash, elastic_damping, true});
    else if (e.backlash > 0)
      soft_.push_back(
          {i, gear_stiffness[static_cast<std::size_t>(std::min(i, 5))], e.backlash, backlash_damping, false});
  }
}

kinematics::DhChain RealArm::chain(double t) const {
  const cell::ArmEffects& arm = cell_.effects.arm;
  kinematics::DhChain out = cell::chain(cell_);
  if (arm.base_roll != 0.0 || arm.base_pitch != 0.0) {
    Vector6 tilt = Vector6::Zero();
    tilt[3] = arm.base_roll, tilt[4] = arm.base_pitch;
    out.T_B_0 = from_xyzrpy(tilt) * out.T_B_0;
  }
  const double growth = 1.0 + arm.growth * (1.0 - std::exp(-t / arm.growth_time_constant));
  for (int i = 0; i < joints(); ++i) {
    const cell::JointEffects& e = cell_.effects.joint(i);
    kinematics::DhJoint& row = out.joints[static_cast<std::size_t>(i)];
    row.a = e.a.value_or(row.a) * growth;
    row.b = e.b.value_or(row.b) * growth;
    row.alpha = e.alpha.value_or(row.alpha);
  }
  return out;
}

kinematics::Dynamics RealArm::dynamics(double t) const {
  std::vector<kinematics::Body> bodies = cell_.robot.links;
  bodies.resize(static_cast<std::size_t>(joints()));
  kinematics::Dynamics out(chain(t), bodies, cell_.robot.gravity);
  if (cell_.tool) {
    const kinematics::Cut cut = below_sensor();
    out.add_body(joints() - 1, cut.body, cut.T_link_S);
  }
  return out;
}

kinematics::Cut RealArm::below_sensor() const {
  const cell::Tool& tool = *cell_.tool;
  const cell::ToolEffects& e = cell_.effects.tool;
  kinematics::Body body = {tool.mass, tool.com, tool.inertia};
  if (e.payload_mass != 0.0) body = kinematics::combined(body, {e.payload_mass, e.payload_com, Vector6::Zero()});
  return {joints() - 1, tool.T_F_S, body};
}

double RealArm::angle(int joint, double q) const {
  const cell::JointEffects& e = cell_.effects.joint(joint);
  if (e.transmission_amplitude == 0.0) return q + e.encoder_offset;
  return q + e.encoder_offset + e.transmission_amplitude * std::sin(e.transmission_cycles * q + e.transmission_phase);
}

double RealArm::angle_slope(int joint, double q) const {
  const cell::JointEffects& e = cell_.effects.joint(joint);
  const double c = e.transmission_cycles;
  return 1.0 + e.transmission_amplitude * c * std::cos(c * q + e.transmission_phase);
}

double RealArm::angle_bend(int joint, double q) const {
  const cell::JointEffects& e = cell_.effects.joint(joint);
  const double c = e.transmission_cycles;
  return -e.transmission_amplitude * c * c * std::sin(c * q + e.transmission_phase);
}

double RealArm::cable(int joint, double q) const {
  const cell::JointEffects& e = cell_.effects.joint(joint);
  return e.cable_stiffness * (q - e.cable_rest);
}

double RealArm::sag(const SoftJoint& joint, double torque) {
  const double play = std::abs(torque) > side_torque ? std::copysign(joint.gap / 2, torque) : 0.0;
  return (joint.sags ? -torque / joint.stiffness : 0.0) - play;
}

VectorXd RealArm::at_rest(const Given& given, const VectorXd& q, double t) const {
  VectorXd rigid(q.size());
  for (int i = 0; i < joints(); ++i) rigid[i] = angle(i, q[i]);
  if (soft_.empty()) return rigid;
  given.need(!cell_.robot.links.empty(), "robot.links");
  kinematics::Dynamics dynamics = this->dynamics(t);
  VectorXd out = rigid;
  for (int pass = 0; pass < 3; ++pass) {  // the load hardly depends on the deflection
    const VectorXd torque = dynamics.gravity_torques(out);
    for (const SoftJoint& s : soft_)
      out[s.joint] = rigid[s.joint] + sag(s, torque[s.joint] + cable(s.joint, out[s.joint]));
  }
  return out;
}

Postures::Postures(const Given& given, const FlangeAt& flange)
    : flange_at_(flange), q_(given.joints("q")), t_(given["t"]), T_B_F_(Pose::Identity()) {}

const Pose& Postures::flange(Index row) {
  if (last_ < 0 || t_[row] != t_[last_] || q_.row(row) != q_.row(last_))
    T_B_F_ = flange_at_(q_.row(row).transpose(), t_[row]);
  last_ = row;
  return T_B_F_;
}

}  // namespace kr5::predict
