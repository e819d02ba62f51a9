// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <kr5/predict/wrench.hpp>
#include "predict/deflection.hpp"
#include "predict/drive_loads.hpp"
#include "predict/kinds.hpp"
#include "predict/motion_memory.hpp"
#include "predict/second_order.hpp"

namespace kr5::predict {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using kinematics::Rows;

/// Motors follow the commands; readings are theirs.
Response follow(const cell::Cell& cell, const Given& given, const VectorXd& t, MotionMemory& memory) {
  const MatrixXd command = given.joints("qc");
  const MatrixXd none(command.rows(), command.cols());
  Response out{none, none, none};
  for (int i = 0; i < cell.robot.joints(); ++i) {
    cell::SecondOrder servo = cell.servo->of_joint(i);
    servo.natural_frequency = cell.effects.joint(i).natural_frequency.value_or(servo.natural_frequency);
    servo.delay = cell.effects.arm.joint_delay.value_or(servo.delay);
    if (!(servo.natural_frequency > 0.0)) given.fail("servo.joint.natural_frequency is not positive");
    Key key;
    key.add(servo.natural_frequency).add(servo.damping_ratio).add(servo.delay).add(t).add(command.col(i));
    const auto axis = memory.axes(std::move(key), [&] { return follow_smooth(servo, t, command.col(i)); });
    out.x.col(i) = axis->col(0);
    out.v.col(i) = axis->col(1);
    out.a.col(i) = axis->col(2);
  }
  return out;
}

/// Motion of the links.
struct Links {
  Rows q, qd, qdd;
};

Links rigid_links(const RealArm& arm, const Response& servo) {
  Links out{servo.x, servo.v, servo.a};
  for (int i = 0; i < arm.joints(); ++i) {
    if (!arm.is_bent(i)) {
      out.q.col(i).array() += arm.angle(i, 0.0);
      continue;
    }
    for (Index k = 0; k < out.q.rows(); ++k) {
      const double q = servo.x(k, i), v = servo.v(k, i), slope = arm.angle_slope(i, q);
      out.q(k, i) = arm.angle(i, q);
      out.qd(k, i) = slope * v;
      out.qdd(k, i) = slope * servo.a(k, i) + arm.angle_bend(i, q) * v * v;
    }
  }
  return out;
}

/// All that the loads of a motion depend on.
Key key_of(const kinematics::DhChain& chain, const std::vector<kinematics::Body>& bodies,
           const Eigen::Vector3d& gravity, const std::optional<kinematics::Cut>& cut, const Links& links) {
  Key key;
  const auto add_body = [&](const kinematics::Body& b) { key.add(b.mass).add(b.com).add(b.inertia); };
  key.add(chain.T_B_0.matrix()).add(gravity);
  for (const kinematics::DhJoint& j : chain.joints)
    key.add(static_cast<double>(j.type)).add(j.b).add(j.theta_offset).add(j.a).add(j.alpha).add(j.beta);
  for (const kinematics::Body& body : bodies) add_body(body);
  if (cut) {
    key.add(cut->T_link_S.matrix());
    add_body(cut->body);
  }
  return std::move(key.add(links.q).add(links.qd).add(links.qdd));
}

void add_cables(const RealArm& arm, const Rows& q, Rows& load) {
  for (int i = 0; i < arm.joints(); ++i)
    for (Index k = 0; k < q.rows(); ++k) load(k, i) += arm.cable(i, q(k, i));
}

/// Torques on the joints, cables included, of a motion of the links.
Rows loads_of(const RealArm& arm, kinematics::Dynamics& dynamics, const Links& links) {
  Rows out = dynamics.loads(links.q, links.qd, links.qdd).tau;
  add_cables(arm, links.q, out);
  return out;
}

/// Adds the deflection of elastic joints and of those with play. The second pass knows how the deflection of the first
/// changes the load, by which a link crosses its play some milliseconds earlier or later.
void deflect_links(const RealArm& arm, kinematics::Dynamics& dynamics, const VectorXd& t, Links& links) {
  std::vector<Index> soft;
  for (const SoftJoint& s : arm.soft()) soft.push_back(s.joint);
  std::vector<MatrixXd> mass;
  for (Index k = 0; k < t.size(); ++k) mass.push_back(dynamics.mass_matrix(links.q.row(k).transpose())(soft, soft));
  const Links rigid = links;
  MatrixXd load = loads_of(arm, dynamics, rigid)(Eigen::all, soft);
  for (const bool last : {false, true}) {
    const Deflection d = deflect(arm.soft(), t, load, mass);
    links = rigid;
    for (std::size_t i = 0; i < soft.size(); ++i) {
      links.q.col(soft[i]) += d.x.col(static_cast<Index>(i));
      links.qd.col(soft[i]) += d.v.col(static_cast<Index>(i));
      links.qdd.col(soft[i]) += d.a.col(static_cast<Index>(i));
    }
    if (last) break;
    load = loads_of(arm, dynamics, links)(Eigen::all, soft);
    for (Index k = 0; k < t.size(); ++k) load.row(k) -= d.a.row(k) * mass[static_cast<std::size_t>(k)];
  }
}

VectorXd increasing_times(const Given& given) {
  const VectorXd t = given["t"];
  for (Index k = 1; k < t.size(); ++k)
    if (!(t[k] > t[k - 1]))
      given.fail("column 't', row " + std::to_string(k + 1) + ": does not increase, found " + std::to_string(t[k]) +
                 " after " + std::to_string(t[k - 1]));
  return t;
}

}  // namespace

Shown motion(const cell::Cell& cell, const Given& given, MotionMemory& memory) {
  given.need(cell.servo && !cell.servo->joint.empty(), "servo.joint");
  const bool massive = !cell.robot.links.empty();
  const VectorXd t = increasing_times(given);
  const RealArm arm(cell);
  const Response servo = follow(cell, given, t, memory);
  Shown out(t.size());
  out.add_each("q", servo.x);
  if (!massive && !cell.tool) return out;
  Links links = rigid_links(arm, servo);
  const double middle = (t[0] + t[t.size() - 1]) / 2;  // warms little in one motion
  kinematics::Dynamics dynamics = arm.dynamics(middle);
  if (!arm.soft().empty()) {
    given.need(massive, "robot.links");
    deflect_links(arm, dynamics, t, links);
  }
  std::optional<kinematics::Cut> cut;
  if (cell.tool) cut = arm.below_sensor();
  const auto loads = memory.loads(key_of(arm.chain(middle), cell.robot.links, cell.robot.gravity, cut, links),
                                  [&] { return dynamics.loads(links.q, links.qd, links.qdd, cut); });
  if (massive) {
    Rows tau = loads->tau;
    add_cables(arm, links.q, tau);
    const MatrixXd torque = drive_torques(cell, t, servo, tau);
    if (cell.drives)
      out.add_each("i", currents(cell, t, servo, torque));
    else
      out.add_each("tau", torque);
  }
  if (cell.tool) {
    MatrixXd wrench = -loads->wrench;
    sense(cell.effects, t, given.runs(), wrench);
    out.add_wrench(wrench);
  }
  return out;
}

}  // namespace kr5::predict
