// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/dart_simulator.hpp>

#include <cmath>

#include <optional>

#include <kr5/core/error.hpp>
#include <kr5/predict/postures.hpp>
#include <kr5/sim/arm.hpp>
#include <kr5/sim/drives.hpp>

#include "kinds.hpp"

namespace kr5::sim {

namespace {

/// The arm at rest at motor-side readings, its links in their gears as the formats say of static kinds.
class StillArm {
 public:
  explicit StillArm(const cell::Cell& cell) : arm_(cell), drives_(cell) {}

  Pose flange(const Eigen::VectorXd& reading, double t) {
    arm_.set_clock(t);
    Eigen::VectorXd q = drives_.link(reading);
    arm_.set_state(q);
    constexpr int passes = 3;  // the sag moves gravity by a part of itself that is tiny
    for (int pass = 0; pass < passes && !drives_.rigid(); ++pass) {
      const Eigen::VectorXd load = arm_.gravity_torque() + drives_.cable(q);
      for (int i = 0; i < drives_.size(); ++i) {
        const JointDrive& joint = drives_.joints[static_cast<std::size_t>(i)];
        q[i] = joint.link(reading[i]) - joint.spring.lead_at_rest(load[i]);
      }
      arm_.set_state(q);
    }
    return arm_.T_B_F();
  }

 private:
  Arm arm_;
  Drives drives_;
};

}  // namespace

void DartSimulatorOptions::validate() const {
  require(step >= 0.0 && std::isfinite(step), "step: must not be negative");
}

DartSimulator::DartSimulator(const DartSimulatorOptions& options) : options_(options) { options_.validate(); }

io::Table DartSimulator::predict(const cell::Cell& cell, const cell::Experiment& experiment) const {
  const predict::Given given(experiment, cell.robot.joints());
  std::optional<StillArm> arm;
  const predict::FlangeAt flange = [&](const Eigen::VectorXd& q, double t) {
    if (!arm) arm.emplace(cell);
    return arm->flange(q, t);
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
