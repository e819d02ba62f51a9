// SPDX-License-Identifier: BSD-3-Clause
#include "moving_kinds.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <kr5/core/delayed_log.hpp>
#include <kr5/force/peg_on_tube.hpp>
#include <kr5/io/node.hpp>
#include <kr5/physics/contact.hpp>
#include <kr5/physics/cubic_spline.hpp>
#include <kr5/physics/path_correction.hpp>
#include <kr5/physics/servo_bank.hpp>
#include <kr5/physics/wrench_sensor.hpp>
#include <kr5/sim/driven_arm.hpp>

#include "held_tool.hpp"
#include "peg_slide.hpp"

namespace kr5::sim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using physics::RowRange;
using predict::ExperimentInput;
using predict::PredictionTable;

namespace {

/// The command of every joint at any time: smooth between the rows, late by the delay of its servo.
class CommandSplines {
 public:
  CommandSplines(const VectorXd& t, const MatrixXd& rows, const physics::EffectiveDrives& drives)
      : t_(t), first_(rows.row(0)) {
    for (Index i = 0; i < rows.cols(); ++i) {
      pieces_.push_back(physics::cubic_spline(t, rows.col(i)));
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
      out[static_cast<Index>(i)] = physics::spline_value(pieces_[i].row(at_[i]), s);
    }
    return out;
  }

 private:
  VectorXd t_, first_;
  std::vector<physics::SplinePieces> pieces_;
  std::vector<double> delays_;
  std::vector<Index> at_;
};

/// Steps the motors through measured positions: by splines, as in the closed form.
class MeasuredMotion {
 public:
  MeasuredMotion(const VectorXd& t, const MatrixXd& rows) : t_(t) {
    for (Index i = 0; i < rows.cols(); ++i) pieces_.push_back(physics::cubic_spline(t, rows.col(i)));
  }

  /// Position, speed and acceleration, a row a joint. Times asked for must not decrease.
  Eigen::MatrixX3d at(double time) {
    while (at_ + 2 < t_.size() && t_[at_ + 1] <= time) ++at_;
    Eigen::MatrixX3d out(static_cast<Index>(pieces_.size()), 3);
    for (std::size_t i = 0; i < pieces_.size(); ++i)
      out.row(static_cast<Index>(i)) = physics::spline_state(pieces_[i].row(at_), time - t_[at_]).transpose();
    return out;
  }

 private:
  VectorXd t_;
  std::vector<physics::SplinePieces> pieces_;
  Index at_ = 0;
};

void check_limits(const cell::Cell& cell, const ExperimentInput& input, const MatrixXd& command) {
  if (!cell.robot.limits) return;
  constexpr double rounding = 1e-5;  // of the columns of a file [rad or m]
  const cell::Limits& limits = *cell.robot.limits;
  for (Index i = 0; i < command.cols(); ++i)
    for (Index k = 0; k < command.rows(); ++k) {
      const bool below = i < limits.lower.size() && command(k, i) < limits.lower[i] - rounding;
      const bool above = i < limits.upper.size() && command(k, i) > limits.upper[i] + rounding;
      if (below || above)
        input.fail("column 'qc" + std::to_string(i + 1) + "', row " + std::to_string(k + 1) + ": found " +
                   io::Node::make_scalar(command(k, i)).scalar + ", robot.limits." + (below ? "lower" : "upper") + "[" +
                   std::to_string(i) + "] is " +
                   io::Node::make_scalar((below ? limits.lower : limits.upper)[i]).scalar);
    }
}

/// Steps the arm to time t in whole steps; `advance(time)` makes the one that ends at a time.
template <class Advance>
void advance_to(DrivenArm& arm, double from, double to, double longest, Advance&& advance) {
  const auto steps = static_cast<int>(std::ceil((to - from) / longest - 1e-6));
  const double step = (to - from) / std::max(steps, 1);
  arm.set_step(step);
  for (int i = 1; i <= steps; ++i) advance(from + i * step);
}

}  // namespace

PredictionTable simulate_motion(const cell::Cell& cell, const ExperimentInput& input,
                                const DartSimulatorOptions& options) {
  const bool measured = input.joint_reference() == cell::JointReference::Measured;
  if (!measured && cell.has_torque_servos())
    input.fail("the full grade does not simulate torque servos (servo.torque); use the fast grade");
  input.need(measured || (cell.servo && !cell.servo->joint.empty()), "servo.joint");
  input.need(!cell.robot.links.empty(), "robot.links");
  const VectorXd t = input["t"];
  for (Index k = 1; k < t.size(); ++k)
    if (!(t[k] > t[k - 1])) input.fail("column 't', row " + std::to_string(k + 1) + ": does not increase");
  const MatrixXd command = input.joints("qc");
  check_limits(cell, input, command);
  DrivenArm arm(cell, {options.step, {}});
  std::optional<CommandSplines> commands;
  std::optional<MeasuredMotion> motion;
  arm.reset(command.row(0).transpose(), t[0]);
  if (measured) {
    motion.emplace(t, command);
    arm.begin_motion(motion->at(t[0]));
  } else {
    commands.emplace(t, command, arm.drives());
  }
  const auto advance = [&](double time) {
    if (measured)
      arm.follow_motion(motion->at(time));
    else
      arm.follow(commands->at(time));
  };
  const double longest = arm.step();
  const Index n = command.cols();
  MatrixXd q(t.size(), n), loads(t.size(), n), wrench(t.size(), 6);
  for (Index k = 0; k < t.size(); ++k) {
    if (k > 0) advance_to(arm, t[k - 1], t[k], longest, advance);
    const ArmReading& now = arm.read();
    q.row(k) = now.position;
    loads.row(k) =
        arm.drives().motors ? now.current : VectorXd(now.torque + now.friction + arm.drives().ripple(now.position));
    wrench.row(k) = now.wrench;
  }
  PredictionTable out(t.size());
  if (!measured) out.add_each("q", q);
  if (arm.drives().motors) {
    const MatrixXd currents = delayed_log(t, loads, physics::current_delay(cell));
    out.add_each("i", currents);
    if (input.has("tau1")) out.add_each("tau", physics::reported_torques(cell, currents));
  } else {
    out.add_each("tau", loads);
  }
  if (cell.tool) {
    physics::apply_sensor_effects(physics::WrenchSensor(cell), t, input.runs(), wrench);
    out.add_wrench(wrench);
  }
  return out;
}

namespace {

constexpr double longest_servo_step = 1e-3;  // [s]

/// Steps the path correction of every run; `at_row(row, z, speed)` sees each cycle.
template <class AtRow>
void follow_path(const cell::Cell& cell, const ExperimentInput& input, const DartSimulatorOptions& options,
                 AtRow&& at_row) {
  input.need(cell.servo && cell.servo->tool, "servo.tool");
  const physics::PathServo servo(cell);
  const double wanted = options.step > 0.0 ? options.step : longest_servo_step;
  const int steps = static_cast<int>(std::ceil(servo.cycle / wanted - 1e-6));
  const auto asked = input["zc"];
  for (const RowRange& run : input.runs()) {
    const VectorXd start = VectorXd::Constant(1, servo.start(asked[run.first]));
    physics::PathCommand command(servo, start[0]);
    physics::ServoBank path({servo.servo}, servo.cycle / steps, physics::CommandHold::ZeroOrderHold);
    path.reset(start);
    for (Index k = run.first; k < run.last; ++k) {
      at_row(k, path.x()[0], path.v()[0]);
      const VectorXd held = VectorXd::Constant(1, command.next(asked[k], path.x()[0]));
      for (int i = 0; i < steps; ++i) path.advance(held);
    }
  }
}

}  // namespace

PredictionTable simulate_step(const cell::Cell& cell, const ExperimentInput& input,
                              const DartSimulatorOptions& options) {
  VectorXd z(input.rows());
  follow_path(cell, input, options, [&](Index k, double at, double) { z[k] = at; });
  PredictionTable out(input.rows());
  out.add("z", z);
  return out;
}

PredictionTable simulate_press(const cell::Cell& cell, const ExperimentInput& input,
                               const DartSimulatorOptions& options) {
  input.need(cell.contact.has_value(), "contact");
  if (!cell.tool) return simulate_step(cell, input, options);
  const physics::EffectiveContact contact(cell);
  HeldTool tool(cell, Pose::Identity());
  VectorXd z(input.rows());
  Eigen::MatrixXd wrench(input.rows(), 6);
  follow_path(cell, input, options, [&](Index k, double at, double speed) {
    z[k] = at;
    tool.place(at, speed);
    tool.touch({0.0, 0.0, contact.force(-at, -speed)});
    wrench.row(k) = tool.wrench_at_rest();  // the formats leave out what little the tool's inertia adds
  });
  physics::apply_sensor_effects(physics::WrenchSensor(cell), input["t"], input.runs(), wrench);
  PredictionTable out(input.rows());
  out.add("z", z);
  out.add_wrench(wrench);
  return out;
}

namespace {

constexpr double settling = 0.05;  // before the first row of a run [s]

PegPosture between(const PegPosture& a, const PegPosture& b, double part) {
  const auto mix = [part](double x, double y) { return x + part * (y - x); };
  return {mix(a.tilt, b.tilt), mix(a.alpha, b.alpha), mix(a.cx, b.cx), mix(a.cy, b.cy), mix(a.held, b.held)};
}

void settle_on_tube(PegSlide& peg, double rest, const PegPosture& at, double step) {
  peg.place(rest - at.held / peg.stiffness(), 0.0);
  for (int i = 0; i < static_cast<int>(settling / step); ++i) peg.advance(at, at.held, step);
}

/// The rows of one profile, and where the peg would rest in each.
struct ProfileRows {
  std::vector<PegPosture> rows;
  VectorXd t, rest;
};

void roll(PegSlide& peg, const RowRange& run, const ProfileRows& input, double longest, VectorXd& z,
          Eigen::MatrixXd& wrench) {
  bool carried = false;
  for (Index k = run.first; k < run.last; ++k) {
    const PegPosture& now = input.rows[static_cast<std::size_t>(k)];
    if (!std::isfinite(input.rest[k])) {  // nothing carries the peg here
      carried = false;
      z[k] = std::numeric_limits<double>::quiet_NaN();
      continue;
    }
    if (!carried) {
      settle_on_tube(peg, input.rest[k], now, longest);
      carried = true;
    } else {
      const PegPosture& before = input.rows[static_cast<std::size_t>(k - 1)];
      const double duration = input.t[k] - input.t[k - 1];
      const auto steps = static_cast<int>(std::ceil(duration / longest - 1e-6));
      for (int i = 1; i <= steps; ++i) {
        const PegPosture at = between(before, now, static_cast<double>(i) / steps);
        peg.advance(at, at.held, duration / steps);
      }
    }
    z[k] = peg.reading(now.held);
    wrench.row(k) = peg.wrench();
  }
}

}  // namespace

PredictionTable simulate_profile(const cell::Cell& cell, const ExperimentInput& input,
                                 const DartSimulatorOptions& options) {
  input.need(cell.contact.has_value(), "contact");
  input.need(cell.peg.has_value(), "peg");
  input.need(cell.tube.has_value(), "tube");
  input.need(cell.tool.has_value(), "tool");
  PegSlide peg(cell, PegSlide::FrictionBy::Formats, options.contact);
  if (options.step > peg.longest_step())
    input.fail("step: the stable bound of this contact is " + std::to_string(1e3 * peg.longest_step()) + " ms");
  const auto tilt = input["tilt"], alpha = input["alpha"], held = input["fc"], cx = input["cx"], cy = input["cy"];
  const force::PegTube bodies{peg.shape().peg_radius, peg.shape().inner_radius, peg.shape().outer_radius};
  ProfileRows rows{{}, input["t"], VectorXd(input.rows())};
  for (Index k = 0; k < input.rows(); ++k) {
    rows.rows.push_back({tilt[k], alpha[k], cx[k], cy[k], held[k]});
    rows.rest[k] = force::resting_height(bodies, peg.tube(), tilt[k], alpha[k], peg.centre(rows.rows.back()));
  }
  VectorXd z(input.rows());
  Eigen::MatrixXd wrench = Eigen::MatrixXd::Constant(input.rows(), 6, std::numeric_limits<double>::quiet_NaN());
  const double step = options.step > 0.0 ? options.step : peg.longest_step();
  for (const RowRange& run : input.runs()) roll(peg, run, rows, step, z, wrench);
  physics::apply_sensor_effects(physics::WrenchSensor(cell), rows.t, input.runs(), wrench);
  PredictionTable out(input.rows());
  out.add("z", z);
  out.add_wrench(wrench);
  return out;
}

}  // namespace kr5::sim
