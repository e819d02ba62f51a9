// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include <kr5/io/node.hpp>
#include <kr5/sim/driven_arm.hpp>

#include <kr5/predict/spline.hpp>
#include <kr5/predict/wrench.hpp>
#include "kinds.hpp"

namespace kr5::sim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using predict::Given;
using predict::Shown;

/// The command of every joint at any time: smooth between the rows, late by the delay of its servo.
class Commands {
 public:
  Commands(const VectorXd& t, const MatrixXd& rows, const Drives& drives) : t_(t), first_(rows.row(0)) {
    for (Index i = 0; i < rows.cols(); ++i) {
      pieces_.push_back(predict::spline(t, rows.col(i)));
      delays_.push_back(drives.servo[static_cast<std::size_t>(i)].delay);
      at_.push_back(0);
    }
  }

  /// Times asked for must not decrease.
  VectorXd at(double time) {
    VectorXd out = first_;
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      const double then = time - delays_[i];
      if (then <= t_[0] || pieces_[i].rows() == 0) continue;
      while (at_[i] + 1 < pieces_[i].rows() && t_[at_[i] + 1] <= then) ++at_[i];
      const double s = then - t_[at_[i]];
      const auto c = pieces_[i].row(at_[i]);
      out[static_cast<Index>(i)] = c[0] + s * (c[1] + s * (c[2] + s * c[3]));
    }
    return out;
  }

 private:
  VectorXd t_, first_;
  std::vector<predict::Pieces> pieces_;
  std::vector<double> delays_;
  std::vector<Index> at_;
};

void check_limits(const cell::Cell& cell, const Given& given, const MatrixXd& command) {
  if (!cell.robot.limits) return;
  constexpr double rounding = 1e-5;  // of the columns of a file [rad or m]
  const cell::Limits& limits = *cell.robot.limits;
  for (Index i = 0; i < command.cols(); ++i)
    for (Index k = 0; k < command.rows(); ++k) {
      const bool below = i < limits.lower.size() && command(k, i) < limits.lower[i] - rounding;
      const bool above = i < limits.upper.size() && command(k, i) > limits.upper[i] + rounding;
      if (below || above)
        given.fail("column 'qc" + std::to_string(i + 1) + "', row " + std::to_string(k + 1) + ": found " +
                   io::Node::of(command(k, i)).scalar + ", robot.limits." + (below ? "lower" : "upper") + "[" +
                   std::to_string(i) + "] is " + io::Node::of((below ? limits.lower : limits.upper)[i]).scalar);
    }
}

/// Currents as they are logged, late by `delay`, linear between rows.
MatrixXd logged(const VectorXd& t, const MatrixXd& values, double delay) {
  if (delay <= 0.0 || t.size() < 2) return values;
  MatrixXd out = values;
  Index before = 0;
  for (Index k = 0; k < t.size(); ++k) {
    const double then = std::max(t[k] - delay, t[0]);
    while (before + 2 < t.size() && t[before + 1] <= then) ++before;
    const double part = (then - t[before]) / (t[before + 1] - t[before]);
    out.row(k) = (1.0 - part) * values.row(before) + part * values.row(before + 1);
  }
  return out;
}

/// Steps the arm to time t in whole steps.
void advance(DrivenArm& arm, Commands& commands, double from, double to, double longest) {
  const auto steps = static_cast<int>(std::ceil((to - from) / longest - 1e-6));
  const double step = (to - from) / std::max(steps, 1);
  arm.set_step(step);
  for (int i = 1; i <= steps; ++i) arm.follow(commands.at(from + i * step));
}

}  // namespace

Shown motion(const cell::Cell& cell, const Given& given, const DartSimulatorOptions& options) {
  given.need(cell.servo && !cell.servo->joint.empty(), "servo.joint");
  given.need(!cell.robot.links.empty(), "robot.links");
  const VectorXd t = given["t"];
  for (Index k = 1; k < t.size(); ++k)
    if (!(t[k] > t[k - 1])) given.fail("column 't', row " + std::to_string(k + 1) + ": does not increase");
  const MatrixXd command = given.joints("qc");
  check_limits(cell, given, command);
  DrivenArm arm(cell, {options.step, {}});
  Commands commands(t, command, arm.drives());
  arm.reset(command.row(0).transpose(), t[0]);
  const double longest = arm.step();
  const Index n = command.cols();
  MatrixXd q(t.size(), n), loads(t.size(), n), wrench(t.size(), 6);
  for (Index k = 0; k < t.size(); ++k) {
    if (k > 0) advance(arm, commands, t[k - 1], t[k], longest);
    const ArmReading& now = arm.read();
    q.row(k) = now.position;
    loads.row(k) =
        arm.drives().motors ? now.current : VectorXd(now.torque + now.friction + arm.drives().ripple(now.position));
    wrench.row(k) = now.wrench;
  }
  Shown out(t.size());
  out.add_each("q", q);
  if (arm.drives().motors)
    out.add_each("i", logged(t, loads, cell.effects.arm.current_delay));
  else
    out.add_each("tau", loads);
  if (cell.tool) {
    predict::sense(cell.effects, t, given.runs(), wrench);
    out.add_wrench(wrench);
  }
  return out;
}

}  // namespace kr5::sim
