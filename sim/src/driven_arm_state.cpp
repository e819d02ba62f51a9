// SPDX-License-Identifier: BSD-3-Clause
#include "driven_arm_state.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <kr5/core/error.hpp>
#include <kr5/physics/effect_targets.hpp>

#include "dry_friction.hpp"

namespace kr5::sim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using physics::JointDrive;

constexpr double longest_step = 1e-3;  // [s]
constexpr double chosen_angle = 0.25;  // of the fastest gear resonance in one step [rad]
constexpr double refresh = 0.012;      // how often the inertia in a gear's damper is looked up [s]

}  // namespace

std::string milliseconds(double seconds) {
  std::ostringstream text;
  text << std::setprecision(4) << 1e3 * seconds << " ms";
  return text.str();
}

DrivenArm::State::State(const cell::Cell& cell, const DrivenArmOptions& given)
    : arm(cell), drives(cell), options(given) {
  options.validate();
  physics::check_effect_targets(cell);
  const int n = drives.size();
  require(options.current_limit.size() == 0 || options.current_limit.size() == n,
          "current_limit: found " + std::to_string(options.current_limit.size()) +
              ", expected one a motor: " + std::to_string(n));
  rotors = drives.rotor_matrix();
  for (int i = 0; i < n; ++i)
    if (!drives.joints[static_cast<std::size_t>(i)].spring.rigid()) elastic.push_back(i);
  for (const JointDrive& j : drives.joints) loaded |= j.friction.needs_gear_torque();
  for (const Index i : elastic) arm.set_actuation(static_cast<int>(i), Actuation::Free);
  x = v = a = q = qd = qdd = current = dry = torque = VectorXd::Zero(n);
}

void DrivenArm::State::place_rigid() {
  for (Index i = 0; i < x.size(); ++i) {
    if (!joint(i).spring.rigid()) continue;
    const physics::LinkState link = joint(i).transmission.motion(x[i], v[i], a[i]);
    q[i] = link.q, qd[i] = link.v, qdd[i] = link.a;
  }
}

double DrivenArm::State::spring_torque(Index i, double link, double link_speed) const {
  const JointDrive& j = joint(i);
  return j.spring.torque(j.transmission.link(x[i]) - link, j.transmission.slope(x[i]) * v[i] - link_speed, inertia[i]);
}

void DrivenArm::State::pose_arm(const VectorXd& positions, const VectorXd& speeds) {
  arm.set_state(positions, speeds);
  if (environment) arm.set_contact(environment(arm.T_base_sensor(), arm.sensor_velocity(), t));
}

const ArmForces& DrivenArm::State::solve(const VectorXd& speeds) {
  pose_arm(q, speeds);
  if (elastic.empty()) return arm.inverse_dynamics(qdd);
  VectorXd command = qdd;
  for (const Index i : elastic)
    command[i] = spring_torque(i, q[i], speeds[i]) - physics::cable_spring(joint(i).cable, q[i]);
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
    const physics::GearSpring& spring = joint(elastic[static_cast<std::size_t>(i)]).spring;
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
  servo = physics::ServoBank(drives.servo, step, physics::CommandHold::FirstOrderHold);
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
  servo = physics::ServoBank(drives.servo, step, physics::CommandHold::FirstOrderHold);
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
  if (!elastic.empty())
    settle([this](const VectorXd& links) {
      arm.set_state(links);
      return arm.gravity_torque();
    });
  if (!servo.empty()) servo.reset(x);
  ideal = true;
  limited = fresh = false;
}

void DrivenArm::State::settle(const std::function<VectorXd(const VectorXd&)>& load) {
  inertia = arm.mass_matrix().diagonal();
  looked_up = t;
  q = physics::links_at_rest(drives.joints, x, physics::RestRule::Motion, load);
  arm.set_state(q, qd);
}

void DrivenArm::State::follow(const VectorXd& command) {
  servo.advance(command);
  Eigen::MatrixX3d motor(x.size(), 3);
  motor << servo.x(), servo.v(), servo.acceleration();
  move_to(motor);
}

void DrivenArm::State::begin_motion(const Eigen::MatrixX3d& motor) {
  x = motor.col(0), v = motor.col(1), a = motor.col(2);
  for (const Index i : elastic) {
    const physics::LinkState rigid = joint(i).transmission.motion(x[i], v[i], a[i]);
    qd[i] = rigid.v, qdd[i] = rigid.a;
  }
  place_rigid();
  if (!elastic.empty())
    settle([this](const VectorXd& links) -> VectorXd {
      arm.set_state(links, qd);
      return arm.inverse_dynamics(qdd).torque;
    });
}

void DrivenArm::State::move_to(const Eigen::MatrixX3d& motor) {
  const double h = step;
  x = motor.col(0), v = motor.col(1), a = motor.col(2);
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
    reading.friction = drives.friction(x, v, reading.torque, t);
    if (drives.motors) current = drives.currents(a, reading.torque + reading.friction + drives.ripple(x));
  } else {
    reading.friction = dry;
    for (Index i = 0; i < x.size(); ++i) reading.friction[i] += speed_friction(i, v[i]);
  }
  if (drives.motors) reading.current = current;
  return reading;
}

double DrivenArm::State::energy() {
  arm.set_state(q, qd);
  double out = arm.energy() + 0.5 * v.dot(rotors * v);
  for (const Index i : elastic) {
    const physics::GearSpring& spring = joint(i).spring;
    const double strain = spring.strain(joint(i).transmission.link(x[i]) - q[i]);
    out += 0.5 * spring.stiffness * strain * strain;
  }
  return out;
}

DrivenArmState DrivenArm::State::state() const {
  return {t,       step,    looked_up, x,      v,     a,      q, qd, qdd, servo.empty() ? x : servo.command(),
          inertia, current, dry,       torque, ideal, limited};
}

void DrivenArm::State::restore(const DrivenArmState& from) {
  for (const auto& [values, name] : {std::pair{&from.position, "position"},
                                     {&from.velocity, "velocity"},
                                     {&from.acceleration, "acceleration"},
                                     {&from.link, "link"},
                                     {&from.link_velocity, "link_velocity"},
                                     {&from.link_acceleration, "link_acceleration"},
                                     {&from.command, "command"}})
    require(values->size() == x.size() && values->allFinite(),
            std::string(name) + ": " + std::to_string(x.size()) + " finite joint values are needed");
  require(from.step > 0.0 && from.step <= longest_step,
          "step: must be positive and at most " + milliseconds(longest_step));
  t = from.t, step = from.step, looked_up = from.looked_up;
  x = from.position, v = from.velocity, a = from.acceleration;
  q = from.link, qd = from.link_velocity, qdd = from.link_acceleration;
  inertia = from.inertia, current = from.current, dry = from.friction, torque = from.torque;
  ideal = from.ideal, limited = from.limited, fresh = false;
  arm.set_clock(t);
  arm.set_state(q, qd);
  servo = physics::ServoBank(drives.servo, step, physics::CommandHold::FirstOrderHold);
  if (servo.empty()) return;
  servo.reset(from.command);
  servo.set(x, v);
}

DrivenArm::State::Point DrivenArm::State::middle() const {
  const double h = 0.5 * step;
  Point out{x + h * v, v + h * a, q, qd};
  for (Index i = 0; i < x.size(); ++i) {
    const JointDrive& j = joint(i);
    const physics::LinkState rigid = j.transmission.motion(out.x[i], out.v[i], 0.0);
    out.q[i] = j.spring.rigid() ? rigid.q : q[i] + h * qd[i];
    out.qd[i] = j.spring.rigid() ? rigid.v : qd[i] + h * qdd[i];
  }
  return out;
}

DrivenArm::State::Equations DrivenArm::State::equations(const Point& at) {
  const Index n = x.size(), m = static_cast<Index>(elastic.size());
  pose_arm(at.q, at.qd);
  const MatrixXd& M = arm.mass_matrix();
  VectorXd slope = VectorXd::Ones(n), bend = VectorXd::Zero(n);  // of a rigid link over its motor side
  for (Index i = 0; i < n; ++i) {
    if (!joint(i).spring.rigid()) continue;
    slope[i] = joint(i).transmission.slope(at.x[i]);
    bend[i] = joint(i).transmission.motion(at.x[i], at.v[i], 0.0).a;
  }
  const VectorXd load = arm.bias_torque() + drives.cable(at.q) + M * bend;
  Equations out{MatrixXd::Zero(n + m, n + m), VectorXd::Zero(n + m)};
  out.H.topLeftCorner(n, n) = slope.asDiagonal() * M * slope.asDiagonal();
  out.rhs.head(n) = -slope.cwiseProduct(load);
  for (Index e = 0; e < m; ++e) {  // an elastic link moves by itself: its row and column go to its own coordinate
    const Index i = elastic[static_cast<std::size_t>(e)];
    out.H.row(n + e).swap(out.H.row(i));
    out.H.col(n + e).swap(out.H.col(i));
    std::swap(out.rhs[n + e], out.rhs[i]);
  }
  out.H.topLeftCorner(n, n) += rotors;
  add_springs(at, out);
  out.rhs.head(n) -= drives.ripple(at.x);
  for (Index i = 0; i < n; ++i) out.rhs[i] -= speed_friction(i, at.v[i]);
  return out;
}

void DrivenArm::State::add_springs(const Point& at, Equations& e) {
  for (std::size_t k = 0; k < elastic.size(); ++k) {
    const Index i = elastic[k];
    const JointDrive& j = joint(i);
    const double slope = j.transmission.slope(at.x[i]);
    torque[i] = j.spring.torque(j.transmission.link(at.x[i]) - at.q[i], slope * at.v[i] - at.qd[i], inertia[i]);
    e.rhs[x.size() + static_cast<Index>(k)] += torque[i];
    e.rhs[i] -= slope * torque[i];
  }
}

VectorXd DrivenArm::State::stacked(const VectorXd& motor, const VectorXd& link) const {
  VectorXd z(motor.size() + static_cast<Index>(elastic.size()));
  z.head(motor.size()) = motor;
  for (std::size_t e = 0; e < elastic.size(); ++e) z[motor.size() + static_cast<Index>(e)] = link[elastic[e]];
  return z;
}

void DrivenArm::State::unstack(const VectorXd& z, VectorXd& motor, VectorXd& link) const {
  motor = z.head(motor.size());
  for (std::size_t e = 0; e < elastic.size(); ++e) link[elastic[e]] = z[motor.size() + static_cast<Index>(e)];
}

double DrivenArm::State::speed_friction(Index i, double speed) const {
  return physics::friction_slope_at(joint(i).friction, speed, t) * speed;
}

physics::FrictionRange DrivenArm::State::dry_friction(Index i, const Point& at) const {
  return physics::dry_friction_at(joint(i).friction, {at.x[i], at.v[i], torque[i], t});
}

void DrivenArm::State::velocity_update(const std::function<VectorXd(const Equations&, const Point&)>& currents_at) {
  const double h = step;
  const Index n = x.size();
  look_up_inertia();
  const Point at = middle();
  t += 0.5 * h;
  const Equations e = equations(at);
  current = currents_at(e, at);
  VectorXd force = e.rhs;
  force.head(n) += drives.torques(current);
  const Eigen::LLT<MatrixXd> llt(e.H);
  const VectorXd speed = stacked(v, qd);
  VectorXd next = speed + h * llt.solve(force);
  VectorXd level(n), offset(n);
  for (Index i = 0; i < n; ++i) {
    const physics::FrictionRange range = dry_friction(i, at);
    level[i] = range.level, offset[i] = range.offset;
  }
  dry.setZero();
  if (level.maxCoeff() > 0.0) {
    const MatrixXd inverse = llt.solve(MatrixXd::Identity(e.H.rows(), n)), response = h * inverse.topRows(n);
    dry = offset + hold_or_slide(response, next.head(n) - response * offset, level);
    next -= h * inverse * dry;
  }
  unstack(stacked(x, q) + 0.5 * h * (speed + next), x, q);
  unstack(next, v, qd);
  unstack((next - speed) / h, a, qdd);
  place_rigid();
  t += 0.5 * h;
  arm.set_clock(t);
  if (!servo.empty()) servo.set(x, v);
  ideal = false;
  note_torque();
}

/// Torque through rigid gears, for friction that needs it; that of the others is their springs'.
void DrivenArm::State::note_torque() {
  if (!loaded) return;
  VectorXd friction = dry;
  for (Index i = 0; i < x.size(); ++i) friction[i] += speed_friction(i, v[i]);
  const VectorXd through = drives.gear_torques(current, x, a, friction);
  for (Index i = 0; i < x.size(); ++i)
    if (joint(i).spring.rigid()) torque[i] = through[i];
}

VectorXd DrivenArm::State::limited_currents(const Equations& e, const VectorXd& command, const Point& at) {
  const Index n = x.size(), m = static_cast<Index>(elastic.size());
  const VectorXd wanted = servo.demand(command, at.x, at.v);
  VectorXd needed = e.H.topLeftCorner(n, n) * wanted - e.rhs.head(n);
  if (m > 0)
    needed += e.H.topRightCorner(n, m) *
              e.H.bottomRightCorner(m, m).llt().solve(e.rhs.tail(m) - e.H.bottomLeftCorner(m, n) * wanted);
  for (Index i = 0; i < n; ++i)
    needed[i] += dry_friction(i, at).along(physics::smoothed_sign(at.v[i] + step * wanted[i]));
  VectorXd out = drives.currents(VectorXd::Zero(n), needed);
  const VectorXd free = out;
  if (options.current_limit.size() > 0) out = out.cwiseMax(-options.current_limit).cwiseMin(options.current_limit);
  limited = out != free;
  return out;
}

}  // namespace kr5::sim
