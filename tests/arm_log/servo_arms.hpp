#pragma once

#include <cmath>
#include <string>

#include <kr5/arm_log/arm_log.hpp>
#include <kr5/cell/cell.hpp>
#include <kr5/cell/recording.hpp>
#include <kr5/core/random.hpp>
#include <kr5/predict/fast_simulator.hpp>

/// @file
/// Small drawn arms whose motors are torque servos, as people build them: they log commands and rounded positions.

namespace kr5::test {

/// An arm that turns about its column and whose further joints move in a vertical plane.
inline cell::Cell servo_arm(int joints, Random& random) {
  cell::Cell out;
  out.name = "servo arm";
  for (int i = 0; i < joints; ++i) {
    kinematics::DhJoint row;
    row.a = i == 0 ? 0.0 : random.uniform(0.09, 0.15);
    row.b = i == 0 ? 0.06 : 0.0;
    row.alpha = i == 0 ? M_PI_2 : 0.0;
    out.robot.dh.push_back(row);
    cell::Link link;
    link.mass = random.uniform(0.08, 0.2);
    link.com = {i == 0 ? 0.0 : -random.uniform(0.4, 0.6) * row.a, random.uniform(-0.01, 0.01), 0.0};
    link.inertia << 2e-4, 3e-4, 3e-4, 0, 0, 0;
    out.robot.links.push_back(link);
    out.robot.joint_names.push_back("joint_" + std::string(1, static_cast<char>('a' + i)));
  }
  out.drives = cell::unit_drives(joints);
  out.servo = cell::Servo{};
  out.servo->cycle = 0.02;
  for (int i = 0; i < joints; ++i) {
    out.drives->rotor_inertia[i] = random.uniform(0.01, 0.03);
    out.drives->friction.coulomb[i] = random.uniform(0.03, 0.08);
    out.drives->friction.viscous[i] = random.uniform(0.05, 0.15);
    cell::TorqueServo servo;
    servo.stiffness = random.uniform(12.0, 30.0);
    servo.damping = random.uniform(0.4, 1.0);
    out.servo->torque.push_back(servo);
  }
  out.tool = cell::Tool{};
  return out;
}

/// A model that knows the links of an arm and nothing else: gains of another scale, no friction, no rotors.
inline cell::Cell ignorant(const cell::Cell& arm, Random& random) {
  cell::Cell out = arm;
  const double factor = std::exp(random.uniform(-3.5, 3.5));
  for (cell::TorqueServo& servo : out.servo->torque) servo = {.stiffness = factor * 20.0, .damping = factor * 0.2};
  out.drives->friction.coulomb.setZero();
  out.drives->friction.viscous.setZero();
  out.drives->rotor_inertia.setConstant(1e-3);
  return out;
}

/// Commands of two sines a joint after a second of rest [rad].
inline Eigen::MatrixXd servo_commands(const Eigen::VectorXd& t, int joints, Random& random) {
  Eigen::MatrixXd out(t.size(), joints);
  for (int j = 0; j < joints; ++j) {
    const double slow = random.uniform(0.15, 0.4), fast = random.uniform(0.6, 1.2), at = random.uniform(-0.3, 0.3);
    for (Eigen::Index i = 0; i < t.size(); ++i) {
      const double s = std::max(t[i] - 1.0, 0.0), rise = std::min(s / 2.0, 1.0);
      out(i, j) = at + rise * (0.5 * std::sin(2 * M_PI * slow * s) + 0.12 * std::sin(2 * M_PI * fast * s));
    }
  }
  return out;
}

/// Positions in which an arm is when it is sent commands.
inline Eigen::MatrixXd servo_positions(const cell::Cell& arm, const Eigen::VectorXd& t,
                                       const Eigen::MatrixXd& command) {
  const int n = arm.robot.joints();
  cell::Experiment e;
  e.name = "motion";
  e.data.columns = {"t"};
  for (int j = 0; j < n; ++j) e.data.columns.push_back("qc" + std::to_string(j + 1));
  e.data.values.resize(t.size(), 1 + n);
  e.data.values << t, command;
  const io::Table shown = predict::FastSimulator().predict(arm, e);
  Eigen::MatrixXd out(t.size(), n);
  for (int j = 0; j < n; ++j) out.col(j) = shown.column("q" + std::to_string(j + 1));
  return out;
}

/// As encoders of 4096 steps a turn read them.
inline Eigen::MatrixXd encoder_readings(const Eigen::MatrixXd& q) {
  constexpr double tick = 2 * M_PI / 4096;
  return (q.array() / tick).round() * tick;
}

/// What such an arm logs.
inline arm_log::ArmLog servo_log(const cell::Cell& arm, Random& random, double duration = 40.0, double step = 0.02) {
  arm_log::ArmLog out;
  const auto rows = static_cast<Eigen::Index>(duration / step);
  out.t = Eigen::VectorXd::LinSpaced(rows, 0.0, step * static_cast<double>(rows - 1));
  out.command = servo_commands(out.t, arm.robot.joints(), random);
  out.q = encoder_readings(servo_positions(arm, out.t, out.command));
  return out;
}

}  // namespace kr5::test
