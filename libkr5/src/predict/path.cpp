// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/predict/contact.hpp>
#include <kr5/predict/wrench.hpp>
#include "predict/kinds.hpp"
#include "predict/second_order.hpp"

namespace kr5::predict {
namespace {

/// Response of the path correction, run by run.
Response follow(const cell::Cell& cell, const Given& given, const std::vector<Run>& runs) {
  given.need(cell.servo && cell.servo->tool, "servo.tool");
  const cell::ArmEffects& e = cell.effects.arm;
  cell::SecondOrder servo = *cell.servo->tool;
  servo.natural_frequency = e.tool_frequency.value_or(servo.natural_frequency);
  servo.damping_ratio = e.tool_damping.value_or(servo.damping_ratio);
  servo.delay = e.tool_delay.value_or(servo.delay);
  if (!(servo.natural_frequency > 0.0)) given.fail("servo.tool.natural_frequency is not positive");
  if (!(cell.servo->cycle > 0.0)) given.fail("servo.cycle is not positive");
  const auto command = given["zc"];
  const Eigen::MatrixXd none(given.rows(), 1);
  Response out{none, none, none};
  for (const Run& run : runs) {
    const Eigen::Index n = run.last - run.first;
    const Response part = follow_held(servo, cell.servo->cycle, command.segment(run.first, n));
    out.x.middleRows(run.first, n) = part.x;
    out.v.middleRows(run.first, n) = part.v;
    out.a.middleRows(run.first, n) = part.a;
  }
  return out;
}

}  // namespace

Shown step(const cell::Cell& cell, const Given& given) {
  Shown out(given.rows());
  out.add("z", follow(cell, given, given.runs()).x);
  return out;
}

Shown press(const cell::Cell& cell, const Given& given) {
  given.need(cell.contact.has_value(), "contact");
  const std::vector<Run> runs = given.runs();
  const Response path = follow(cell, given, runs);
  const RealContact contact(cell);
  Shown out(given.rows());
  out.add("z", path.x);
  if (!cell.tool) return out;
  Eigen::MatrixXd wrench = tool_weight(cell, given.rows());
  for (Eigen::Index k = 0; k < given.rows(); ++k) wrench(k, 2) -= contact.force(-path.x(k, 0), -path.v(k, 0));
  sense(cell.effects, given["t"], runs, wrench);
  out.add_wrench(wrench);
  return out;
}

}  // namespace kr5::predict
