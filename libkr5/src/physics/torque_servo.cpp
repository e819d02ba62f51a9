// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/torque_servo.hpp>

#include <cmath>
#include <limits>

namespace kr5::physics {

double torque_servo_delay(const cell::Cell& cell, int joint) {
  return cell.effects.replaced_number("joint_delay", "delay").value_or(cell.servo->torque_of(joint).delay);
}

double servo_stiffness(const cell::Cell& cell, int joint) {
  return cell.effects.replaced_number("servo_stiffness", "stiffness", joint)
      .value_or(cell.servo->torque_of(joint).stiffness);
}

double servo_damping(const cell::Cell& cell, int joint) {
  return cell.effects.replaced_number("servo_damping", "damping", joint).value_or(cell.servo->torque_of(joint).damping);
}

double servo_integral(const cell::Cell& cell, int joint) {
  return cell.effects.replaced_number("servo_integral", "integral", joint)
      .value_or(cell.servo->torque_of(joint).integral);
}

double servo_dead_band(const cell::Cell& cell, int joint) {
  return cell.effects.replaced_number("servo_dead_band", "dead_band", joint)
      .value_or(cell.servo->torque_of(joint).dead_band);
}

std::optional<double> torque_limit(const cell::Cell& cell, int joint) {
  const std::optional<double> stated = cell.servo->torque_of(joint).torque_limit;
  const double other = cell.effects.number("torque_limit", "torque", joint);
  if (std::isinf(other)) return stated;
  return std::min(stated.value_or(other), other);
}

double torque_dead_band(const cell::Cell& cell, int joint) {
  return cell.effects.replaced_number("torque_dead_band", "torque", joint)
      .value_or(cell.servo->torque_of(joint).torque_dead_band);
}

double servo_voltage(const cell::Cell& cell, int joint) {
  return cell.effects.number("servo_voltage", "voltage", joint);
}

cell::TorqueServo torque_servo(const cell::Cell& cell, int joint) {
  cell::TorqueServo out = cell.servo->torque_of(joint);
  out.stiffness = servo_stiffness(cell, joint);
  out.damping = servo_damping(cell, joint);
  out.integral = servo_integral(cell, joint);
  out.dead_band = servo_dead_band(cell, joint);
  out.torque_limit = torque_limit(cell, joint);
  out.torque_dead_band = torque_dead_band(cell, joint);
  const double voltage = servo_voltage(cell, joint);
  if (out.stall_torque) *out.stall_torque *= voltage;
  if (out.no_load_speed) *out.no_load_speed *= voltage;
  out.delay = torque_servo_delay(cell, joint);
  return out;
}

std::vector<cell::TorqueServo> torque_servos(const cell::Cell& cell) {
  std::vector<cell::TorqueServo> out;
  if (!cell.has_torque_servos()) return out;
  for (int i = 0; i < cell.robot.joints(); ++i) out.push_back(torque_servo(cell, i));
  return out;
}

TorqueBound torque_bound(const cell::TorqueServo& servo, double side, double speed) {
  const double limit = servo.torque_limit.value_or(std::numeric_limits<double>::infinity());
  const TorqueBound by_torque{side * limit, 0.0};
  if (!servo.stall_torque || !servo.no_load_speed) return by_torque;
  const TorqueBound by_voltage{side * *servo.stall_torque, *servo.stall_torque / *servo.no_load_speed};
  return side * by_voltage.at(speed) < side * by_torque.at(speed) ? by_voltage : by_torque;
}

double servo_torque(const cell::TorqueServo& servo, double error, double integral, double command_speed, double speed) {
  const double asked = servo.stiffness * effective_error(servo, error) + servo.integral * integral +
                       servo.feed_forward * command_speed - servo.damping * speed;
  const double given = effective_torque(servo, asked);
  // Not std::clamp: beyond the no-load speed the bounds cross zero, and of two that cross each other the lower holds.
  return std::min(std::max(given, torque_bound(servo, -1.0, speed).at(speed)),
                  torque_bound(servo, 1.0, speed).at(speed));
}

const std::vector<std::string>& servo_motion_effects() {
  static const std::vector<std::string> out = {"servo_stiffness", "servo_damping", "coulomb_friction", "joint_delay",
                                               "rotor_inertia"};
  return out;
}

const std::vector<std::string>& further_servo_effects() {
  static const std::vector<std::string> out = {"load_friction", "quadratic_drag", "servo_dead_band"};
  return out;
}

const std::string& coasting_effect() {
  static const std::string out = "viscous_friction";
  return out;
}

}  // namespace kr5::physics
