// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/predict/fast_simulator.hpp>

#include <kr5/cell/effect.hpp>

#include "predict/kinds.hpp"
#include "predict/motion_memory.hpp"
#include "predict/real_arm.hpp"

namespace kr5::predict {
namespace {

/// What lies beyond the last joint may only be there at its off value.
void require_targets(const cell::Cell& cell) {
  const auto n = static_cast<std::size_t>(cell.robot.joints());
  if (cell.effects.joints.size() <= n && cell.effects.motors.size() <= n) return;
  for (const cell::ActiveEffect& active : cell::active_effects(cell.effects)) {
    const auto targets = cell::effect_targets(cell::find_effect(active.id), cell);
    require(std::find(targets.begin(), targets.end(), active.target) != targets.end(),
            "effects." + active.id + "." + active.target + ": the cell has only " + std::to_string(n) + " joints");
  }
}

Shown predicted(const cell::Cell& cell, cell::Kind kind, const Given& given, MotionMemory& memory) {
  using enum cell::Kind;
  const RealArm arm(cell);
  const FlangeAt flange = [&](const Eigen::VectorXd& q, double t) {
    return arm.chain(t).flange(arm.at_rest(given, q, t));
  };
  switch (kind) {
    case Motion:
      return motion(cell, given, memory);
    case Poses:
      return poses(cell, given, flange);
    case Views:
      return views(cell, given, flange);
    case Scan:
      return scan(cell, given, flange);
    case Step:
      return step(cell, given);
    case Press:
      return press(cell, given);
    case Profile:
      return profile(cell, given);
  }
  throw InvalidArgument("no kind of experiment has the number " + std::to_string(static_cast<int>(kind)));
}

}  // namespace

FastSimulator::FastSimulator() : memory_(std::make_shared<MotionMemory>()) {}

io::Table FastSimulator::predict(const cell::Cell& cell, const cell::Experiment& experiment) const {
  require_targets(cell);
  return predicted(cell, experiment.kind, Given(experiment, cell.robot.joints()), *memory_).table();
}

}  // namespace kr5::predict
