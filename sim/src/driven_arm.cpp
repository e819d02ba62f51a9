// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/driven_arm.hpp>

#include <cmath>

#include <kr5/core/error.hpp>

#include "driven_arm_state.hpp"

namespace kr5::sim {

using Eigen::VectorXd;

void DrivenArmOptions::validate() const {
  require(step >= 0.0 && std::isfinite(step), "step: must not be negative");
  require((current_limit.array() > 0.0).all(), "current_limit: every limit must be positive");
}

DrivenArm::DrivenArm(const cell::Cell& cell, const DrivenArmOptions& options)
    : state_(std::make_unique<State>(cell, options)) {
  state_->reset(VectorXd::Zero(state_->drives.size()), 0.0);
}
DrivenArm::~DrivenArm() = default;
DrivenArm::DrivenArm(DrivenArm&&) noexcept = default;
DrivenArm& DrivenArm::operator=(DrivenArm&&) noexcept = default;

const physics::EffectiveDrives& DrivenArm::drives() const { return state_->drives; }
Arm& DrivenArm::arm() { return state_->arm; }
double DrivenArm::step() const { return state_->step; }
double DrivenArm::stable_step(const VectorXd& position) { return state_->stable_step(position); }

void DrivenArm::set_step(double step) {
  require(step > 0.0 && step <= state_->step * (1.0 + 1e-9),
          "step: must not exceed the present step of " + milliseconds(state_->step));
  state_->set_step(step);
}

void DrivenArm::reset(const VectorXd& position, double t) { state_->reset(position, t); }
void DrivenArm::set_environment(Environment environment) { state_->environment = std::move(environment); }
void DrivenArm::environment_changed() { state_->fresh = false; }

void DrivenArm::follow(const VectorXd& command) {
  require(!state_->servo.empty(), "servo.joint: this cell has no joint servo");
  require(command.size() == state_->x.size(), "command: expected one value per joint");
  state_->fresh = false;
  state_->ideal = true;
  state_->follow(command);
}

void DrivenArm::begin_motion(const Eigen::MatrixX3d& motor) {
  require(motor.rows() == state_->x.size(), "motor: expected one row per joint");
  state_->fresh = false;
  state_->begin_motion(motor);
}

void DrivenArm::follow_motion(const Eigen::MatrixX3d& motor) {
  require(motor.rows() == state_->x.size(), "motor: expected one row per joint");
  state_->fresh = false;
  state_->ideal = true;
  state_->move_to(motor);
}

void DrivenArm::follow_limited(const VectorXd& command) {
  require(!state_->servo.empty(), "servo.joint: this cell has no joint servo");
  require(command.size() == state_->x.size(), "command: expected one value per joint");
  require(state_->drives.motors.has_value(), "drives: currents need motors");
  state_->fresh = false;
  state_->velocity_update([&](const auto& e, const auto& at) { return state_->limited_currents(e, command, at); });
}

void DrivenArm::drive(const VectorXd& current) {
  require(state_->drives.motors.has_value(), "drives: currents need motors");
  require(current.size() == state_->x.size(), "current: expected one value per motor");
  state_->fresh = state_->limited = false;
  state_->velocity_update([&](const auto&, const auto&) { return current; });
}

const ArmReading& DrivenArm::read() { return state_->read(); }
double DrivenArm::energy() { return state_->energy(); }
DrivenArmState DrivenArm::state() const { return state_->state(); }
void DrivenArm::restore(const DrivenArmState& state) { state_->restore(state); }

}  // namespace kr5::sim
