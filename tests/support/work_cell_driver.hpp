// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include <kr5/cell/cell.hpp>
#include <kr5/core/error.hpp>
#include <kr5/kinematics/inverse.hpp>
#include <kr5/robot/servo_feedforward.hpp>
#include <kr5/sim/work_cell.hpp>

/// @file
/// Moves the tool of a work cell from place to place for tests, as a program of a real cell would.

namespace kr5::test {

/// The tool points straight down there.
inline Pose down_at(const Eigen::Vector3d& tip) {
  Pose out(Eigen::Translation3d{tip});
  out.rotate(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
  return out;
}

class WorkCellDriver {
 public:
  explicit WorkCellDriver(sim::WorkCell& cell) : cell_(cell) { last_.gripper.hold = false; }

  /// Goes on as another one does.
  WorkCellDriver(sim::WorkCell& cell, const WorkCellDriver& other) : cell_(cell), last_(other.last_) {}

  /// Stands there with the tool.
  void start(const Pose& T_base_tool) {
    const cell::Cell& c = cell_.believed();
    kinematics::InverseOptions options;
    options.lower = c.robot.limits->lower;
    options.upper = c.robot.limits->upper;
    options.near = Eigen::VectorXd::Zero(c.robot.joints());
    const auto found =
        kinematics::inverse_kinematics(cell::nominal_chain(c), T_base_tool * c.tool->T_flange_tool.inverse(), options);
    const kinematics::Posture* best = nullptr;
    for (const kinematics::Posture& p : found.postures)
      if (p.usable() && (!best || p.q.norm() < best->q.norm())) best = &p;
    require(best != nullptr, "the arm does not reach the start");
    cell_.place(best->q);
    last_ = robot::tool_command(T_base_tool);
    last_.gripper.hold = false;
    wait(0.1);
  }

  /// Smoothly to a pose, ahead as the servo of the path needs it, and until the arm has settled.
  void go(const Pose& to, double duration, double rest = 1.0) {
    const Pose from = last_.tool;
    const Eigen::Vector3d way = to.translation() - from.translation();
    const Eigen::Vector3d turn = log_rotation(to.linear() * from.linear().transpose());
    const auto& servo = cell_.believed().servo->tool;
    const robot::ServoFeedforward lead(servo ? servo->natural_frequency : 0.0, servo ? servo->damping_ratio : 1.0);
    for (double t = cell_.cycle(); t < duration + rest; t += cell_.cycle()) {
      const double s = std::min(t / duration, 1.0);
      const double x = s * s * s * (10 + s * (6 * s - 15)), v = 30 * s * s * (1 - s) * (1 - s) / duration;
      const double a = 60 * s * (1 - s) * (1 - 2 * s) / (duration * duration);
      const double share = x + lead(v, a);
      last_.tool.translation() = from.translation() + share * way;
      last_.tool.linear() = exp_rotation(share * turn) * from.linear();
      step();
    }
    last_.tool = to;
    step();
  }
  void wait(double time) {
    for (double t = 0; t < time; t += cell_.cycle()) step();
  }
  void grip(bool hold, bool fingers = false) {
    last_.gripper.hold = hold;
    last_.gripper.fingers = fingers;
  }
  void step() {
    reading = cell_.read();
    cell_.send(last_);
  }
  const robot::RobotCommand& last() const { return last_; }

  robot::RobotReading reading;

 private:
  sim::WorkCell& cell_;
  robot::RobotCommand last_;
};

}  // namespace kr5::test
