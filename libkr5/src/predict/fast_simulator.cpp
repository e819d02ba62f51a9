// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/predict/fast_simulator.hpp>

#include <kr5/physics/effective_arm.hpp>
#include <kr5/physics/joint_drive.hpp>
#include <kr5/predict/static_kinds.hpp>

#include "predict/motion_cache.hpp"
#include "predict/moving_kinds.hpp"

namespace kr5::predict {
namespace {

/// Flange poses of the arm at rest, in closed form.
FlangeAtRest flange_at_rest(const cell::Cell& cell, const ExperimentInput& input) {
  return [&input, &cell, arm = physics::EffectiveArm(cell), joints = physics::joint_drives(cell)](
             const Eigen::VectorXd& q, double t) {
    std::optional<kinematics::Dynamics> dynamics;
    const auto gravity = [&](const Eigen::VectorXd& links) {
      input.need(!cell.robot.links.empty(), "robot.links");
      if (!dynamics) dynamics.emplace(arm.dynamics(t));
      return dynamics->gravity_torques(links);
    };
    return arm.chain(t).flange(physics::links_at_rest(joints, q, physics::RestRule::Static, gravity));
  };
}

PredictionTable predict_kind(const cell::Cell& cell, cell::Kind kind, const ExperimentInput& input,
                             MotionCache& cache) {
  using enum cell::Kind;
  switch (kind) {
    case Motion:
      return predict_motion(cell, input, cache);
    case Poses:
      return predict_poses(cell, input, flange_at_rest(cell, input));
    case Views:
      return predict_views(cell, input, flange_at_rest(cell, input));
    case Scan:
      return predict_scan(cell, input, flange_at_rest(cell, input));
    case Step:
      return predict_step(cell, input);
    case Press:
      return predict_press(cell, input);
    case Profile:
      return predict_profile(cell, input);
  }
  throw InvalidArgument("unknown kind of experiment: " + std::to_string(static_cast<int>(kind)));
}

}  // namespace

FastSimulator::FastSimulator() : cache_(std::make_shared<MotionCache>()) {}

io::Table FastSimulator::simulate(const cell::Cell& cell, const cell::Experiment& experiment) const {
  const ExperimentInput input(experiment, cell.robot.joints());
  return predict_kind(cell, experiment.kind, input, *cache_).table();
}

}  // namespace kr5::predict
