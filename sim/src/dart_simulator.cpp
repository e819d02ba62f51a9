// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/dart_simulator.hpp>

#include <cmath>

#include <optional>

#include <kr5/core/error.hpp>
#include <kr5/predict/postures.hpp>
#include <kr5/sim/driven_arm.hpp>

#include "kinds.hpp"

namespace kr5::sim {

void DartSimulatorOptions::validate() const {
  require(step >= 0.0 && std::isfinite(step), "step: must not be negative");
}

DartSimulator::DartSimulator(const DartSimulatorOptions& options) : options_(options) { options_.validate(); }

io::Table DartSimulator::predict(const cell::Cell& cell, const cell::Experiment& experiment) const {
  const predict::Given given(experiment, cell.robot.joints());
  std::optional<DrivenArm> arm;
  const predict::FlangeAt flange = [&](const Eigen::VectorXd& q, double t) {
    if (!arm) arm.emplace(cell);
    arm->reset(q, t);
    return arm->arm().T_B_F();
  };
  using enum cell::Kind;
  switch (experiment.kind) {
    case Motion:
      return motion(cell, given, options_).table();
    case Step:
      return step(cell, given, options_).table();
    case Press:
      return press(cell, given, options_).table();
    case Profile:
      return profile(cell, given, options_).table();
    case Poses:
      return predict::poses(cell, given, flange).table();
    case Views:
      return predict::views(cell, given, flange).table();
    case Scan:
      return predict::scan(cell, given, flange).table();
  }
  given.fail("is of a kind that does not exist");
}

}  // namespace kr5::sim
