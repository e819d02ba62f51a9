// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/dart_simulator.hpp>

#include <cmath>
#include <optional>

#include <kr5/core/error.hpp>
#include <kr5/physics/joint_drive.hpp>
#include <kr5/predict/static_kinds.hpp>
#include <kr5/sim/arm.hpp>

#include "moving_kinds.hpp"

namespace kr5::sim {
namespace {

/// The arm at rest at motor-side readings, its links in their gears as the formats say of static kinds.
class RestingArm {
 public:
  explicit RestingArm(const cell::Cell& cell) : arm_(cell), joints_(physics::joint_drives(cell)) {}

  Pose T_base_flange(const Eigen::VectorXd& reading, double t) {
    arm_.set_clock(t);
    const auto gravity = [this](const Eigen::VectorXd& links) {
      arm_.set_state(links);
      return arm_.gravity_torque();
    };
    arm_.set_state(physics::links_at_rest(joints_, reading, physics::RestRule::Static, gravity));
    return arm_.T_base_flange();
  }

 private:
  Arm arm_;
  std::vector<physics::JointDrive> joints_;
};

predict::PredictionTable simulate_kind(const cell::Cell& cell, cell::Kind kind, const predict::ExperimentInput& input,
                                       const DartSimulatorOptions& options) {
  std::optional<RestingArm> arm;
  const predict::FlangeAtRest flange = [&](const Eigen::VectorXd& q, double t) {
    if (!arm) arm.emplace(cell);
    return arm->T_base_flange(q, t);
  };
  using enum cell::Kind;
  switch (kind) {
    case Motion:
      return simulate_motion(cell, input, options);
    case Step:
      return simulate_step(cell, input, options);
    case Press:
      return simulate_press(cell, input, options);
    case Profile:
      return simulate_profile(cell, input, options);
    case Poses:
      return predict::predict_poses(cell, input, flange);
    case Views:
      return predict::predict_views(cell, input, flange);
    case Scan:
      return predict::predict_scan(cell, input, flange);
  }
  input.fail("is of an unknown kind");
}

}  // namespace

void DartSimulatorOptions::validate() const {
  require(step >= 0.0 && std::isfinite(step), "step: must not be negative");
}

DartSimulator::DartSimulator(const DartSimulatorOptions& options) : options_(options) { options_.validate(); }

io::Table DartSimulator::simulate(const cell::Cell& cell, const cell::Experiment& experiment) const {
  const predict::ExperimentInput input(experiment, cell.robot.joints());
  return simulate_kind(cell, experiment.kind, input, options_).table();
}

}  // namespace kr5::sim
