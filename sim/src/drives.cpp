// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/drives.hpp>

#include <array>
#include <cmath>

#include <Eigen/LU>

#include <kr5/core/error.hpp>

namespace kr5::sim {
namespace {

constexpr double sign_width = 0.002;      // of tanh(v / width), [rad/s or m/s]
constexpr double elastic_damping = 0.06;  // formats.md, elastic joint
constexpr double backlash_damping = 0.3;  // formats.md, backlash
constexpr double no_load = 1e-6;          // what rounding leaves of no load, [N m or N]
constexpr double side_torque = 0.5;       // what takes a link to one side of its play, [N m]
constexpr std::array<double, 6> tooth_stiffness = {8e5, 8e5, 4e5, 8e4, 5e4, 3e4};  // formats.md, [N m/rad]

GearSpring gear_spring(const cell::JointEffects& effects, std::size_t joint) {
  if (effects.elasticity < std::numeric_limits<double>::infinity())
    return {effects.elasticity, effects.backlash, elastic_damping, true};
  if (effects.backlash == 0.0) return {};
  return {tooth_stiffness.at(std::min(joint, tooth_stiffness.size() - 1)), effects.backlash, backlash_damping, false};
}

void require_size(Eigen::Index found, int expected, const std::string& field) {
  require(found == expected,
          field + ": found " + std::to_string(found) + " values, expected one a joint: " + std::to_string(expected));
}

}  // namespace

double GearSpring::torque(double lead, double lead_speed, double inertia) const {
  const double half = 0.5 * gap;
  const double strain = lead > half ? lead - half : (lead < -half ? lead + half : 0.0);
  return stiffness * strain + 2.0 * damping_ratio * std::sqrt(stiffness * inertia) * lead_speed;
}

double GearSpring::lead_in_balance(double torque) const {
  if (rigid() || std::abs(torque) < no_load) return 0.0;
  return std::copysign(0.5 * gap, torque) + torque / stiffness;
}

double GearSpring::lead_at_rest(double torque) const {
  if (rigid()) return 0.0;
  return (std::abs(torque) > side_torque ? std::copysign(0.5 * gap, torque) : 0.0) + (sags ? torque / stiffness : 0.0);
}

double JointDrive::cold(double t) const {
  return thermal_drop == 0.0 ? 1.0 : 1.0 + thermal_drop * std::expm1(-t / thermal_time_constant);
}

double JointDrive::dry_friction(double v, double transmitted, double t) const {
  double level = coulomb + load_coefficient * std::abs(transmitted);
  if (stribeck != 0.0) level += stribeck * std::exp(-(v / stribeck_velocity) * (v / stribeck_velocity));
  return cold(t) * level;
}

double JointDrive::viscous_friction(double v, double t) const { return cold(t) * viscous * v; }

double JointDrive::friction(double v, double transmitted, double t) const {
  return dry_friction(v, transmitted, t) * std::tanh(v / sign_width) + viscous_friction(v, t);
}

double JointDrive::ripple(double q) const {
  return ripple_amplitude == 0.0 ? 0.0 : ripple_amplitude * std::sin(ripple_cycles * q + ripple_phase);
}

double JointDrive::cable(double q) const { return cable_stiffness * (q - cable_rest); }

double JointDrive::link(double q) const {
  return q + encoder_offset + error_amplitude * std::sin(error_cycles * q + error_phase);
}

double JointDrive::link_slope(double q) const {
  return 1.0 + error_amplitude * error_cycles * std::cos(error_cycles * q + error_phase);
}

double JointDrive::link_curvature(double q) const {
  return -error_amplitude * error_cycles * error_cycles * std::sin(error_cycles * q + error_phase);
}

Drives::Drives(const cell::Cell& cell) {
  const int n = cell.robot.joints();
  const auto count = static_cast<std::size_t>(n);
  require(cell.effects.joints.size() <= count, "effects: joint" + std::to_string(cell.effects.joints.size()) +
                                                   " carries an effect, but the arm has " + std::to_string(n) +
                                                   " joints");
  motors = cell.drives.has_value();
  for (std::size_t i = 0; i < count; ++i) {
    const cell::JointEffects& e = cell.effects.joint(static_cast<int>(i));
    JointDrive& j = joints.emplace_back();
    j.stribeck = e.stribeck, j.stribeck_velocity = e.stribeck_velocity, j.load_coefficient = e.load_coefficient;
    j.thermal_drop = e.thermal_drop, j.thermal_time_constant = e.thermal_time_constant;
    j.cable_stiffness = e.cable_stiffness, j.cable_rest = e.cable_rest;
    j.ripple_amplitude = e.ripple_amplitude, j.ripple_cycles = e.ripple_cycles, j.ripple_phase = e.ripple_phase;
    j.encoder_offset = e.encoder_offset;
    j.error_amplitude = e.transmission_amplitude, j.error_cycles = e.transmission_cycles;
    j.error_phase = e.transmission_phase;
    j.coulomb = e.coulomb.value_or(0.0), j.viscous = e.viscous.value_or(0.0);
    j.spring = gear_spring(e, i);
  }
  if (cell.servo && !cell.servo->joint.empty()) {
    for (int i = 0; i < n; ++i) {
      servo.push_back(cell.servo->of_joint(i));
      servo.back().natural_frequency = cell.effects.joint(i).natural_frequency.value_or(servo.back().natural_frequency);
      servo.back().delay = cell.effects.arm.joint_delay.value_or(servo.back().delay);
    }
  }
  if (!motors) return;
  const cell::Drives& drives = *cell.drives;
  require(drives.structure.rows() == n && drives.structure.cols() == n,
          "drives.structure: expected " + std::to_string(n) + " x " + std::to_string(n));
  require_size(drives.rotor_inertia.size(), n, "drives.rotor_inertia");
  require_size(drives.torque_constant.size(), n, "drives.torque_constant");
  require_size(drives.friction.coulomb.size(), n, "drives.friction.coulomb");
  require_size(drives.friction.viscous.size(), n, "drives.friction.viscous");
  structure = drives.structure;
  rotor_inertia = drives.rotor_inertia;
  torque_constant = drives.torque_constant;
  for (int i = 0; i < n; ++i) {
    const cell::JointEffects& e = cell.effects.joint(i);
    const cell::MotorEffects& m = cell.effects.motor(i);
    joints[static_cast<std::size_t>(i)].coulomb = e.coulomb.value_or(drives.friction.coulomb[i]);
    joints[static_cast<std::size_t>(i)].viscous = e.viscous.value_or(drives.friction.viscous[i]);
    rotor_inertia[i] = e.rotor_inertia.value_or(rotor_inertia[i]);
    torque_constant[i] = e.torque_constant.value_or(torque_constant[i]);
    if (!m.coupling_value) continue;
    require(m.coupling_element >= 0 && m.coupling_element < n,
            "effects.wrist_coupling.motor" + std::to_string(i + 1) + ".element: found " +
                std::to_string(m.coupling_element) + ", the structure matrix has columns 0 to " +
                std::to_string(n - 1));
    structure(i, m.coupling_element) = *m.coupling_value;
  }
  require(structure.fullPivLu().isInvertible(), "drives.structure: has no inverse");
}

bool Drives::rigid() const {
  bool all = true;
  for (const JointDrive& joint : joints) all &= joint.spring.rigid();
  return all;
}

Eigen::MatrixXd Drives::rotor_matrix() const {
  if (!motors) return Eigen::MatrixXd::Zero(size(), size());
  return structure.transpose() * rotor_inertia.asDiagonal() * structure;
}

Eigen::VectorXd Drives::friction(const Eigen::VectorXd& v, const Eigen::VectorXd& transmitted, double t) const {
  Eigen::VectorXd out(size());
  for (int i = 0; i < size(); ++i) out[i] = joints[static_cast<std::size_t>(i)].friction(v[i], transmitted[i], t);
  return out;
}

Eigen::VectorXd Drives::ripple(const Eigen::VectorXd& q) const {
  Eigen::VectorXd out(size());
  for (int i = 0; i < size(); ++i) out[i] = joints[static_cast<std::size_t>(i)].ripple(q[i]);
  return out;
}

Eigen::VectorXd Drives::cable(const Eigen::VectorXd& q) const {
  Eigen::VectorXd out(size());
  for (int i = 0; i < size(); ++i) out[i] = joints[static_cast<std::size_t>(i)].cable(q[i]);
  return out;
}

Eigen::VectorXd Drives::link(const Eigen::VectorXd& q) const {
  Eigen::VectorXd out(size());
  for (int i = 0; i < size(); ++i) out[i] = joints[static_cast<std::size_t>(i)].link(q[i]);
  return out;
}

Eigen::VectorXd Drives::currents(const Eigen::VectorXd& acceleration, const Eigen::VectorXd& torque) const {
  require(motors, "drives: this cell has no motors");
  const Eigen::VectorXd motor =
      rotor_inertia.cwiseProduct(structure * acceleration) + structure.transpose().partialPivLu().solve(torque);
  return motor.cwiseQuotient(torque_constant);
}

Eigen::VectorXd Drives::torques(const Eigen::VectorXd& currents) const {
  require(motors, "drives: this cell has no motors");
  return structure.transpose() * torque_constant.cwiseProduct(currents);
}

}  // namespace kr5::sim
