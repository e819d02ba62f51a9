#pragma once

#include <cmath>
#include <string>
#include <vector>

#include <kr5/arm_log/arm_log.hpp>
#include <kr5/cell/cell.hpp>
#include <kr5/cell/recording.hpp>
#include <kr5/core/random.hpp>
#include <kr5/predict/fast_simulator.hpp>

#include "support/arm_cells.hpp"

/// @file
/// A synthetic arm of three joints as a stranger logs it, and its model as a description states it.

namespace kr5::test {

constexpr int logged_joints = 3;

/// Links and names of joints; no drives, servos or sensors.
inline cell::Cell described_arm() {
  const cell::Cell whole = arm_cell({"rrr"});
  cell::Cell out;
  out.name = "arm";
  out.robot = whole.robot;
  out.robot.joint_names = {"shoulder", "elbow", "wrist"};
  return out;
}

/// The same with drives of unit gear, which moved: friction and the rest are for a test to set.
inline cell::Cell moved_arm() {
  cell::Cell out = described_arm();
  out.drives = cell::unit_drives(logged_joints);
  out.tool = cell::Tool{};
  return out;
}

struct LoggedMotionOptions {
  int rows = 1500;
  double step = 0.01;                            // [s]
  double delay = 0.0;                            // of the efforts [s]
  double slowness = 1.0;                         // of the motion [-]
  std::vector<double> noise = {0.2, 0.1, 0.03};  // of the efforts [N m]
  std::uint64_t seed = 3;
};

/// Positions of a motion that begins and ends at no rest, by two sines a joint [rad].
inline Eigen::MatrixXd swinging(const Eigen::VectorXd& t) {
  Eigen::MatrixXd q(t.size(), logged_joints);
  for (int j = 0; j < logged_joints; ++j) {
    const double rate = 1.3 + 0.45 * j;
    q.col(j) = 0.3 * j + 0.5 * (rate * t.array()).sin() + 0.2 * ((2.3 * rate + 0.3) * t.array() + j).cos();
  }
  return q;
}

/// Efforts of a true arm in a motion, noise apart [N m].
inline Eigen::MatrixXd efforts_of(const cell::Cell& arm, const Eigen::VectorXd& t, const Eigen::MatrixXd& q) {
  cell::Experiment e;
  e.name = "motion";
  e.joint_reference = cell::JointReference::Measured;
  e.data.columns = {"t"};
  for (const char* family : {"qc", "tau"})  // joint torques are shown beside currents where they are recorded
    for (int j = 0; j < logged_joints; ++j) e.data.columns.push_back(family + std::to_string(j + 1));
  e.data.values = Eigen::MatrixXd::Zero(t.size(), 1 + 2 * logged_joints);
  e.data.values.col(0) = t;
  e.data.values.middleCols(1, logged_joints) = q;
  const io::Table shown = predict::FastSimulator().predict(arm, e);
  Eigen::MatrixXd out(t.size(), logged_joints);
  for (int j = 0; j < logged_joints; ++j) out.col(j) = shown.column("tau" + std::to_string(j + 1));
  return out;
}

/// The log of a true arm with unit drives; its efforts are late by the delay.
inline arm_log::ArmLog logged(const cell::Cell& arm, const LoggedMotionOptions& options = {}) {
  arm_log::ArmLog out;
  out.t = Eigen::VectorXd::LinSpaced(options.rows, 0.0, options.step * (options.rows - 1));
  const Eigen::VectorXd motion = out.t / options.slowness;
  out.q = swinging(motion);
  const Eigen::VectorXd late = (out.t.array() - options.delay) / options.slowness;
  // Efforts of a time depend on the motion alone: late ones are those of the motion that much earlier.
  out.effort = efforts_of(arm, out.t, swinging(late));
  Random random(options.seed);
  for (int j = 0; j < logged_joints; ++j) {
    out.q.col(j) += 1e-5 * random.normal_vector(options.rows);
    out.effort.col(j) += options.noise[static_cast<std::size_t>(j)] * random.normal_vector(options.rows);
  }
  return out;
}

}  // namespace kr5::test
