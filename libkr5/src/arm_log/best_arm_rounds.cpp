// SPDX-License-Identifier: BSD-3-Clause
#include "best_arm_rounds.hpp"

#include <algorithm>
#include <string>

#include <kr5/core/error.hpp>

#include "joint_columns.hpp"

namespace kr5::arm_log {

namespace {

constexpr double smaller = 2.0 / 3;  // of an error, from which another round pays

void subtract_causes(cell::Experiment& experiment, const io::Table& nominal, const io::Table& tuned, int joints) {
  const std::string family = load_family(experiment);
  for (int k = 1; k <= joints; ++k) {
    const std::string name = family + std::to_string(k);
    if (nominal.find(name) < 0 || tuned.find(name) < 0) continue;
    experiment.data.values.col(experiment.data.find(name)) -= tuned.column(name) - nominal.column(name);
  }
}

}  // namespace

cell::Recording without_causes(const cell::Recording& recording, const cell::Simulator& simulator,
                               const cell::Cell& tuned) {
  cell::Recording out = recording;
  for (cell::Experiment& e : out.experiments) {
    if (load_family(e).empty()) continue;
    try {
      subtract_causes(e, simulator.predict(recording.cell, e), simulator.predict(tuned, e),
                      recording.cell.robot.joints());
    } catch (const InvalidArgument&) {
      continue;
    }
  }
  return out;
}

bool lessens(const BestArmErrors& before, const BestArmErrors& after) {
  return std::ranges::any_of(after.errors, [&](const gap::ColumnError& now) {
    return std::ranges::any_of(before.errors, [&](const gap::ColumnError& then) {
      return then.column == now.column && now.error < smaller * then.error;
    });
  });
}

}  // namespace kr5::arm_log
