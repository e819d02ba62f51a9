// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/driven_arm.hpp>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

#include <Eigen/Eigenvalues>

#include <kr5/core/error.hpp>

#include "driven_state.hpp"

namespace kr5::sim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double longest_step = 1e-3;  // [s]
constexpr double chosen_angle = 0.25;  // of the fastest gear resonance in one step [rad]
constexpr double refresh = 0.012;      // how often the inertia in a gear's damper is looked up [s]

std::string milliseconds(double seconds) {
  std::ostringstream text;
  text << std::setprecision(4) << 1e3 * seconds << " ms";
  return text.str();
}

}  // namespace

void DrivenArmOptions::validate() const {
  require(step >= 0.0 && std::isfinite(step), "step: must not be negative");
  require((current_limit.array() > 0.0).all(), "current_limit: every limit must be positive");
}

DrivenArm::State::State(const cell::Cell& cell, const DrivenArmOptions& given)
    : arm(cell), drives(cell), options(given) {
  options.validate();
  const int n = drives.size();
  require(options.current_limit.size() == 0 || options.current_limit.size() == n,
          "current_limit: found " + std::to_string(options.current_limit.size()) +
              ", expected one a motor: " + std::to_string(n));
  rotors = drives.rotor_matrix();
  for (int i = 0; i < n; ++i)
    if (!drives.joints[static_cast<std::size_t>(i)].spring.rigid()) elastic.push_back(i);
  for (const JointDrive& j : drives.joints) loaded |= j.load_coefficient != 0.0;
  for (const Index i : elastic) arm.set_actuation(static_cast<int>(i), Actuation::Free);
  x = v = a = q = qd = qdd = current = dry = torque = VectorXd::Zero(n);
}

void DrivenArm::State::place_rigid() {
  for (Index i = 0; i < x.size(); ++i) {
    if (!joint(i).spring.rigid()) continue;
    const double slope = joint(i).link_slope(x[i]);
    q[i] = joint(i).link(x[i]);
    qd[i] = slope * v[i];
    qdd[i] = slope * a[i] + joint(i).link_curvature(x[i]) * v[i] * v[i];
  }
}

double DrivenArm::State::spring_torque(Index i, double link, double link_speed) const {
  const JointDrive& j = joint(i);
  return j.spring.torque(j.link(x[i]) - link, j.link_slope(x[i]) * v[i] - link_speed, inertia[i]);
}

void DrivenArm::State::pose_arm(const VectorXd& positions, const VectorXd& speeds) {
  arm.set_state(positions, speeds);
  if (environment) arm.set_contact(environment(arm.T_B_S(), arm.sensor_velocity(), t));
}

const ArmForces& DrivenArm::State::solve(const VectorXd& speeds) {
  pose_arm(q, speeds);
  if (elastic.empty()) return arm.inverse_dynamics(qdd);
  VectorXd command = qdd;
  for (const Index i : elastic) command[i] = spring_torque(i, q[i], speeds[i]) - joint(i).cable(q[i]);
  return arm.solve(command);
}

void DrivenArm::State::look_up_inertia() {
  if (elastic.empty() || t < looked_up + refresh) return;
  arm.set_state(q, qd);
  inertia = arm.mass_matrix().diagonal();
  looked_up = t;
}

double DrivenArm::State::fastest(const VectorXd& position, double* ratio) {
  arm.set_state(drives.link(position));
  const MatrixXd& M = arm.mass_matrix();
  const auto n = static_cast<Index>(elastic.size());
  MatrixXd K = MatrixXd::Zero(n, n), Me(n, n);
  for (Index i = 0; i < n; ++i) {
    const GearSpring& spring = joint(elastic[static_cast<std::size_t>(i)]).spring;
    K(i, i) = spring.stiffness;
    *ratio = std::max(*ratio, spring.damping_ratio);
    for (Index j = 0; j < n; ++j)
      Me(i, j) = M(elastic[static_cast<std::size_t>(i)], elastic[static_cast<std::size_t>(j)]);
  }
  return std::sqrt(Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd>(K, Me).eigenvalues().maxCoeff());
}

void DrivenArm::State::set_step(double given) {
  if (std::abs(given - step) < 1e-9 * step) return;
  step = given;
  const VectorXd command = servo.empty() ? x : servo.command();
  servo = ServoBank(drives.servo, step, ServoBank::Between::Line);
  if (servo.empty()) return;
  servo.reset(command);
  servo.set(x, v);
}

double DrivenArm::State::stable_step(const VectorXd& position) {
  if (elastic.empty()) return std::numeric_limits<double>::infinity();
  double ratio = 0.0;
  const double frequency = fastest(position, &ratio);
  // Where the step below turns an oscillation into its opposite: (wh)^2 + 8 zeta wh = 4.
  return 2.0 * (std::sqrt(1.0 + 4.0 * ratio * ratio) - 2.0 * ratio) / frequency;
}

void DrivenArm::State::choose_step(const VectorXd& position) {
  step = longest_step;
  if (options.step > 0.0) {
    const double bound = stable_step(position);
    require(options.step <= bound, "step: " + milliseconds(options.step) +
                                       " is not stable with these gears; the stable bound here is " +
                                       milliseconds(bound));
    step = options.step;
  } else if (!elastic.empty()) {
    double ratio = 0.0;
    const double wanted = chosen_angle / fastest(position, &ratio);
    step = longest_step / std::max(1.0, std::ceil(longest_step / wanted));
  }
  servo = ServoBank(drives.servo, step, ServoBank::Between::Line);
}

void DrivenArm::State::reset(const VectorXd& position, double start) {
  require(position.size() == x.size() && position.allFinite(),
          "position: " + std::to_string(x.size()) + " finite joint values are needed");
  t = start;
  choose_step(position);
  arm.set_clock(t);
  x = position;
  v = a = qd = qdd = current = dry = torque = VectorXd::Zero(x.size());
  q = drives.link(x);
  place_rigid();
  arm.set_state(q);
  if (!elastic.empty()) settle();
  if (!servo.empty()) servo.reset(x);
  ideal = true;
  limited = fresh = false;
}

void DrivenArm::State::settle() {
  inertia = arm.mass_matrix().diagonal();
  looked_up = t;
  for (int pass = 0; pass < 3; ++pass) {  // the sag moves gravity by a part of itself that is tiny
    const VectorXd load = arm.gravity_torque() + drives.cable(q);
    for (const Index i : elastic) q[i] = joint(i).link(x[i]) - joint(i).spring.lead_in_balance(load[i]);
    arm.set_state(q);
  }
}

void DrivenArm::State::follow(const VectorXd& command) {
  const double h = step;
  servo.advance(command);
  x = servo.x(), v = servo.v(), a = servo.acceleration();
  const VectorXd old_speed = qd, old_acceleration = qdd;
  place_rigid();
  t += h;
  arm.set_clock(t);
  if (elastic.empty()) return;
  look_up_inertia();
  VectorXd predicted = qd;
  for (const Index i : elastic) {
    q[i] += h * old_speed[i] + 0.5 * h * h * old_acceleration[i];
    predicted[i] = old_speed[i] + h * old_acceleration[i];
  }
  const VectorXd& now = solve(predicted).acceleration;
  for (const Index i : elastic) {
    qdd[i] = now[i];
    qd[i] = old_speed[i] + 0.5 * h * (old_acceleration[i] + now[i]);
  }
}

const ArmReading& DrivenArm::State::read() {
  if (fresh) return reading;
  fresh = true;
  const ArmForces& forces = solve(qd);
  if (!elastic.empty()) qdd = forces.acceleration;
  reading.t = t;
  reading.position = x, reading.velocity = v, reading.acceleration = a;
  reading.link = q;
  reading.torque = forces.torque + drives.cable(q);
  reading.wrench = forces.wrench;
  reading.limited = limited;
  if (ideal) {
    reading.friction = drives.friction(v, reading.torque, t);
    if (drives.motors) current = drives.currents(a, reading.torque + reading.friction + drives.ripple(x));
  } else {
    reading.friction = dry;
    for (Index i = 0; i < x.size(); ++i) reading.friction[i] += joint(i).viscous_friction(v[i], t);
  }
  if (drives.motors) reading.current = current;
  return reading;
}

double DrivenArm::State::energy() {
  arm.set_state(q, qd);
  double out = arm.energy() + 0.5 * v.dot(rotors * v);
  for (const Index i : elastic) {
    const GearSpring& spring = joint(i).spring;
    const double strain = std::max(std::abs(joint(i).link(x[i]) - q[i]) - 0.5 * spring.gap, 0.0);
    out += 0.5 * spring.stiffness * strain * strain;
  }
  return out;
}

DrivenArm::DrivenArm(const cell::Cell& cell, const DrivenArmOptions& options)
    : state_(std::make_unique<State>(cell, options)) {
  state_->reset(VectorXd::Zero(state_->drives.size()), 0.0);
}
DrivenArm::~DrivenArm() = default;
DrivenArm::DrivenArm(DrivenArm&&) noexcept = default;
DrivenArm& DrivenArm::operator=(DrivenArm&&) noexcept = default;

const Drives& DrivenArm::drives() const { return state_->drives; }
Arm& DrivenArm::arm() { return state_->arm; }
double DrivenArm::step() const { return state_->step; }
double DrivenArm::stable_step(const VectorXd& position) { return state_->stable_step(position); }

void DrivenArm::set_step(double step) {
  require(step > 0.0 && step <= state_->step * (1.0 + 1e-9),
          "step: may only be made smaller, down from " + milliseconds(state_->step));
  state_->set_step(step);
}

void DrivenArm::reset(const VectorXd& position, double t) { state_->reset(position, t); }
void DrivenArm::set_environment(Environment environment) { state_->environment = std::move(environment); }
void DrivenArm::environment_changed() { state_->fresh = false; }

void DrivenArm::follow(const VectorXd& command) {
  require(!state_->servo.empty(), "servo.joint: this cell has no joint servo");
  require(command.size() == state_->x.size(), "command: one value a joint is needed");
  state_->fresh = false;
  state_->ideal = true;
  state_->follow(command);
}

void DrivenArm::follow_limited(const VectorXd& command) {
  require(!state_->servo.empty(), "servo.joint: this cell has no joint servo");
  require(command.size() == state_->x.size(), "command: one value a joint is needed");
  require(state_->drives.motors, "drives: currents need motors");
  state_->fresh = false;
  state_->kick([&](const auto& e, const auto& at) { return state_->limited_currents(e, command, at); });
}

void DrivenArm::drive(const VectorXd& current) {
  require(state_->drives.motors, "drives: currents need motors");
  require(current.size() == state_->x.size(), "current: one value a motor is needed");
  state_->fresh = state_->limited = false;
  state_->kick([&](const auto&, const auto&) { return current; });
}

const ArmReading& DrivenArm::read() { return state_->read(); }
double DrivenArm::energy() { return state_->energy(); }

}  // namespace kr5::sim
