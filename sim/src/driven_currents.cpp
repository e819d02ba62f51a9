// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <Eigen/Cholesky>

#include "driven_state.hpp"
#include "dry_friction.hpp"

namespace kr5::sim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double still_speed = 0.002;  // of the friction feed-forward, as in the law of friction [rad/s]

}  // namespace

DrivenArm::State::Point DrivenArm::State::middle() const {
  const double h = 0.5 * step;
  Point out{x + h * v, v + h * a, q, qd};
  for (Index i = 0; i < x.size(); ++i) {
    const JointDrive& j = joint(i);
    out.q[i] = j.spring.rigid() ? j.link(out.x[i]) : q[i] + h * qd[i];
    out.qd[i] = j.spring.rigid() ? j.link_slope(out.x[i]) * out.v[i] : qd[i] + h * qdd[i];
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
    slope[i] = joint(i).link_slope(at.x[i]);
    bend[i] = joint(i).link_curvature(at.x[i]) * at.v[i] * at.v[i];
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
  for (Index i = 0; i < n; ++i) out.rhs[i] -= joint(i).viscous_friction(at.v[i], t);
  return out;
}

void DrivenArm::State::add_springs(const Point& at, Equations& e) {
  for (std::size_t k = 0; k < elastic.size(); ++k) {
    const Index i = elastic[k];
    const JointDrive& j = joint(i);
    const double slope = j.link_slope(at.x[i]);
    torque[i] = j.spring.torque(j.link(at.x[i]) - at.q[i], slope * at.v[i] - at.qd[i], inertia[i]);
    e.rhs[x.size() + static_cast<Index>(k)] += torque[i];
    e.rhs[i] -= slope * torque[i];
  }
}

VectorXd DrivenArm::State::joined(const VectorXd& motor, const VectorXd& link) const {
  VectorXd z(motor.size() + static_cast<Index>(elastic.size()));
  z.head(motor.size()) = motor;
  for (std::size_t e = 0; e < elastic.size(); ++e) z[motor.size() + static_cast<Index>(e)] = link[elastic[e]];
  return z;
}

void DrivenArm::State::split(const VectorXd& z, VectorXd& motor, VectorXd& link) const {
  motor = z.head(motor.size());
  for (std::size_t e = 0; e < elastic.size(); ++e) link[elastic[e]] = z[motor.size() + static_cast<Index>(e)];
}

VectorXd DrivenArm::State::levels(const VectorXd& speeds) const {
  VectorXd out(speeds.size());
  for (Index i = 0; i < speeds.size(); ++i) out[i] = joint(i).dry_friction(speeds[i], torque[i], t);
  return out;
}

void DrivenArm::State::kick(const std::function<VectorXd(const Equations&, const Point&)>& currents_at) {
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
  const VectorXd speed = joined(v, qd);
  VectorXd next = speed + h * llt.solve(force);
  const VectorXd level = levels(at.v);
  dry.setZero();
  if (level.maxCoeff() > 0.0) {
    const MatrixXd inverse = llt.solve(MatrixXd::Identity(e.H.rows(), n));
    dry = hold_or_slide(h * inverse.topRows(n), next.head(n), level);
    next -= h * inverse * dry;
  }
  split(joined(x, q) + 0.5 * h * (speed + next), x, q);
  split(next, v, qd);
  split((next - speed) / h, a, qdd);
  place_rigid();
  t += 0.5 * h;
  arm.set_clock(t);
  if (!servo.empty()) servo.set(x, v);
  ideal = false;
  note_torque();
}

/// Torque through rigid gears, for friction that grows with it: what the motor side does not use up itself.
void DrivenArm::State::note_torque() {
  if (!loaded) return;
  const VectorXd used = rotors * a + dry + drives.ripple(x), motor = drives.torques(current);
  for (Index i = 0; i < x.size(); ++i)
    if (joint(i).spring.rigid()) torque[i] = motor[i] - used[i] - joint(i).viscous_friction(v[i], t);
}

VectorXd DrivenArm::State::limited_currents(const Equations& e, const VectorXd& command, const Point& at) {
  const Index n = x.size(), m = static_cast<Index>(elastic.size());
  const VectorXd wanted = servo.demand(command, at.x, at.v);
  VectorXd needed = e.H.topLeftCorner(n, n) * wanted - e.rhs.head(n);
  if (m > 0)
    needed += e.H.topRightCorner(n, m) *
              e.H.bottomRightCorner(m, m).llt().solve(e.rhs.tail(m) - e.H.bottomLeftCorner(m, n) * wanted);
  const VectorXd level = levels(at.v);
  for (Index i = 0; i < n; ++i) needed[i] += level[i] * std::tanh((at.v[i] + step * wanted[i]) / still_speed);
  VectorXd out = drives.currents(VectorXd::Zero(n), needed);
  const VectorXd free = out;
  if (options.current_limit.size() > 0) out = out.cwiseMax(-options.current_limit).cwiseMin(options.current_limit);
  limited = out != free;
  return out;
}

}  // namespace kr5::sim
