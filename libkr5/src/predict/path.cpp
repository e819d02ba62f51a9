// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/predict/contact.hpp>
#include <kr5/predict/path_correction.hpp>
#include <kr5/predict/wrench.hpp>
#include "predict/kinds.hpp"

namespace kr5::predict {
namespace {

/// z and its speed in each row, run by run.
Eigen::MatrixX2d follow(const cell::Cell& cell, const Given& given, const std::vector<Run>& runs) {
  given.need(cell.servo && cell.servo->tool, "servo.tool");
  const PathServo servo(cell);
  const auto asked = given["zc"];
  Eigen::MatrixX2d out(given.rows(), 2);
  for (const Run& run : runs) {
    PathCorrection path(servo, servo.start(asked[run.first]));
    for (Eigen::Index k = run.first; k < run.last; ++k) {
      out.row(k) << path.z(), path.speed();
      path.advance(asked[k]);
    }
  }
  return out;
}

}  // namespace

Shown step(const cell::Cell& cell, const Given& given) {
  Shown out(given.rows());
  out.add("z", follow(cell, given, given.runs()).col(0));
  return out;
}

Shown press(const cell::Cell& cell, const Given& given) {
  given.need(cell.contact.has_value(), "contact");
  const std::vector<Run> runs = given.runs();
  const Eigen::MatrixX2d path = follow(cell, given, runs);
  const RealContact contact(cell);
  Shown out(given.rows());
  out.add("z", path.col(0));
  if (!cell.tool) return out;
  Eigen::MatrixXd wrench = tool_weight(cell, given.rows());
  for (Eigen::Index k = 0; k < given.rows(); ++k) wrench(k, 2) -= contact.force(-path(k, 0), -path(k, 1));
  sense(cell.effects, given["t"], runs, wrench);
  out.add_wrench(wrench);
  return out;
}

}  // namespace kr5::predict
