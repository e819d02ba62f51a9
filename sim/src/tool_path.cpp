// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include <kr5/predict/contact.hpp>
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

constexpr double longest_step = 1e-3;  // [s]

cell::SecondOrder tool_servo(const cell::Cell& cell, const Given& given) {
  given.need(cell.servo && cell.servo->tool, "servo.tool");
  const cell::ArmEffects& e = cell.effects.arm;
  cell::SecondOrder servo = *cell.servo->tool;
  servo.natural_frequency = e.tool_frequency.value_or(servo.natural_frequency);
  servo.damping_ratio = e.tool_damping.value_or(servo.damping_ratio);
  servo.delay = e.tool_delay.value_or(servo.delay);
  return servo;
}

/// Steps the path correction of every run; `at_row(row, z, speed)` sees each cycle.
template <class AtRow>
void follow(const cell::Cell& cell, const Given& given, const DartSimulatorOptions& options, AtRow&& at_row) {
  const cell::SecondOrder servo = tool_servo(cell, given);
  const double cycle = cell.servo->cycle;
  if (!(cycle > 0.0)) given.fail("servo.cycle is not positive");
  const int steps = static_cast<int>(std::ceil(cycle / (options.step > 0.0 ? options.step : longest_step) - 1e-6));
  const auto late = static_cast<Index>(std::lround(servo.delay / cycle));
  const auto command = given["zc"];
  for (const Run& run : given.runs()) {
    ServoBank path({servo}, cycle / steps, ServoBank::Between::Held);
    path.reset(command.segment(run.first, 1));
    for (Index k = run.first; k < run.last; ++k) {
      at_row(k, path.x()[0], path.v()[0]);
      const VectorXd held = command.segment(std::max(k - late, run.first), 1);
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
