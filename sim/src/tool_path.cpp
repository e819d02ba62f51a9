// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <kr5/predict/contact.hpp>
#include <kr5/predict/path_correction.hpp>
#include <kr5/predict/wrench.hpp>
#include "held_tool.hpp"
#include "kinds.hpp"
#include "servo.hpp"

namespace kr5::sim {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using predict::Given;
using predict::Run;
using predict::Shown;

constexpr double longest_servo_step = 1e-3;  // [s]

/// Steps the path correction of every run; `at_row(row, z, speed)` sees each cycle.
template <class AtRow>
void follow(const cell::Cell& cell, const Given& given, const DartSimulatorOptions& options, AtRow&& at_row) {
  given.need(cell.servo && cell.servo->tool, "servo.tool");
  const predict::PathServo servo(cell);
  const double wanted = options.step > 0.0 ? options.step : longest_servo_step;
  const int steps = static_cast<int>(std::ceil(servo.cycle / wanted - 1e-6));
  const auto asked = given["zc"];
  for (const Run& run : given.runs()) {
    const VectorXd start = VectorXd::Constant(1, servo.start(asked[run.first]));
    predict::PathCommand command(servo, start[0]);
    ServoBank path({servo.servo}, servo.cycle / steps, ServoBank::Between::Held);
    path.reset(start);
    for (Index k = run.first; k < run.last; ++k) {
      at_row(k, path.x()[0], path.v()[0]);
      const VectorXd held = VectorXd::Constant(1, command.next(asked[k], path.x()[0]));
      for (int i = 0; i < steps; ++i) path.advance(held);
    }
  }
}

}  // namespace

Shown step(const cell::Cell& cell, const Given& given, const DartSimulatorOptions& options) {
  VectorXd z(given.rows());
  follow(cell, given, options, [&](Index k, double at, double) { z[k] = at; });
  Shown out(given.rows());
  out.add("z", z);
  return out;
}

Shown press(const cell::Cell& cell, const Given& given, const DartSimulatorOptions& options) {
  given.need(cell.contact.has_value(), "contact");
  if (!cell.tool) return step(cell, given, options);
  const predict::RealContact contact(cell);
  HeldTool tool(cell, Pose::Identity());
  VectorXd z(given.rows());
  Eigen::MatrixXd wrench(given.rows(), 6);
  follow(cell, given, options, [&](Index k, double at, double speed) {
    z[k] = at;
    tool.place(at, speed);
    tool.touch({0.0, 0.0, contact.force(-at, -speed)});
    wrench.row(k) = tool.wrench_at_rest();  // the formats leave out what little the tool's inertia adds
  });
  predict::sense(cell.effects, given["t"], given.runs(), wrench);
  Shown out(given.rows());
  out.add("z", z);
  out.add_wrench(wrench);
  return out;
}

}  // namespace kr5::sim
