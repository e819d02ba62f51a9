// SPDX-License-Identifier: BSD-3-Clause
#include "predict/moving_kinds.hpp"

#include <kr5/cell/servo_gain.hpp>
#include <kr5/core/delayed_log.hpp>
#include <kr5/force/peg_on_tube.hpp>
#include <kr5/physics/contact.hpp>
#include <kr5/physics/cubic_spline.hpp>
#include <kr5/physics/effective_arm.hpp>
#include <kr5/physics/effective_drives.hpp>
#include <kr5/physics/path_correction.hpp>
#include <kr5/physics/second_order.hpp>
#include <kr5/physics/tool.hpp>
#include <kr5/physics/tube.hpp>
#include <kr5/physics/wrench_sensor.hpp>

#include "predict/deflection.hpp"
#include "predict/motion_cache.hpp"
#include "predict/servo_arm.hpp"

namespace kr5::predict {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using kinematics::Rows;

namespace {

/// Position, speed and acceleration, one row a sample; one column an axis.
struct MotorMotion {
  MatrixXd x, v, a;
};

/// Motors follow the commands; readings are theirs.
MotorMotion follow_commands(const physics::EffectiveDrives& drives, const MatrixXd& command, const VectorXd& t,
                            MotionCache& cache) {
  const MatrixXd none(command.rows(), command.cols());
  MotorMotion out{none, none, none};
  for (int i = 0; i < drives.size(); ++i) {
    const cell::SecondOrder& servo = drives.servo[static_cast<std::size_t>(i)];
    CacheKey key;
    key.add(servo.natural_frequency).add(servo.damping_ratio).add(servo.delay).add(t).add(command.col(i));
    const auto axis =
        cache.axes.find_or_make(std::move(key), [&] { return physics::follow_smooth(servo, t, command.col(i)); });
    out.x.col(i) = axis->col(0);
    out.v.col(i) = axis->col(1);
    out.a.col(i) = axis->col(2);
  }
  return out;
}

/// Motors that pass through measured positions.
MotorMotion measured_motion(const MatrixXd& position, const VectorXd& t, MotionCache& cache) {
  const MatrixXd none(position.rows(), position.cols());
  MotorMotion out{none, none, none};
  for (Index i = 0; i < position.cols(); ++i) {
    CacheKey key;
    key.add(t).add(position.col(i));
    const auto axis =
        cache.axes.find_or_make(std::move(key), [&] { return physics::spline_motion(t, position.col(i)); });
    out.x.col(i) = axis->col(0);
    out.v.col(i) = axis->col(1);
    out.a.col(i) = axis->col(2);
  }
  return out;
}

/// Motion of the links, a row a sample.
struct LinkMotion {
  Rows q, qd, qdd;
};

LinkMotion rigid_links(const physics::EffectiveDrives& drives, const MotorMotion& motor) {
  LinkMotion out{motor.x, motor.v, motor.a};
  for (Index i = 0; i < motor.x.cols(); ++i) {
    const physics::Transmission& transmission = drives.joint(i).transmission;
    if (transmission.uniform()) {
      out.q.col(i).array() += transmission.encoder_offset;
      continue;
    }
    for (Index k = 0; k < out.q.rows(); ++k) {
      const physics::LinkState link = transmission.motion(motor.x(k, i), motor.v(k, i), motor.a(k, i));
      out.q(k, i) = link.q, out.qd(k, i) = link.v, out.qdd(k, i) = link.a;
    }
  }
  return out;
}

/// All that the loads of a motion depend on.
CacheKey load_key(const kinematics::DhChain& chain, const std::vector<kinematics::Body>& bodies,
                  const Eigen::Vector3d& gravity, const std::optional<kinematics::SensorCut>& cut,
                  const LinkMotion& links) {
  CacheKey key;
  const auto add_body = [&](const kinematics::Body& b) { key.add(b.mass).add(b.com).add(b.inertia); };
  key.add(chain.T_base_0.matrix()).add(gravity);
  for (const kinematics::DhJoint& j : chain.joints)
    key.add(static_cast<double>(j.type)).add(j.b).add(j.theta_offset).add(j.a).add(j.alpha).add(j.beta);
  for (const kinematics::Body& body : bodies) add_body(body);
  if (cut) {
    key.add(cut->T_link_sensor.matrix());
    add_body(cut->body);
  }
  return std::move(key.add(links.q).add(links.qd).add(links.qdd));
}

void add_cables(const physics::EffectiveDrives& drives, const Rows& q, Rows& load) {
  for (Index i = 0; i < q.cols(); ++i)
    for (Index k = 0; k < q.rows(); ++k) load(k, i) += physics::cable_spring(drives.joint(i).cable, q(k, i));
}

/// Torques on the joints, cables included, of a motion of the links.
Rows joint_loads(const physics::EffectiveDrives& drives, kinematics::Dynamics& dynamics, const LinkMotion& links) {
  Rows out = dynamics.loads(links.q, links.qd, links.qdd).tau;
  add_cables(drives, links.q, out);
  return out;
}

/// Adds the deflection of elastic joints and of those with play. The second pass knows how the deflection of the first
/// changes the load, by which a link crosses its play some milliseconds earlier or later.
void deflect_links(const physics::EffectiveDrives& drives, kinematics::Dynamics& dynamics, const VectorXd& t,
                   LoadBetweenRows between, LinkMotion& links) {
  std::vector<Index> soft;
  std::vector<physics::GearSpring> springs;
  for (Index i = 0; i < drives.size(); ++i) {
    if (drives.joint(i).spring.rigid()) continue;
    soft.push_back(i);
    springs.push_back(drives.joint(i).spring);
  }
  std::vector<MatrixXd> mass;
  for (Index k = 0; k < t.size(); ++k) mass.push_back(dynamics.mass_matrix(links.q.row(k).transpose())(soft, soft));
  const LinkMotion rigid = links;
  MatrixXd load = joint_loads(drives, dynamics, rigid)(Eigen::all, soft);
  for (const bool last : {false, true}) {
    const Deflection d = deflect(springs, t, load, mass, between);
    links = rigid;
    for (std::size_t i = 0; i < soft.size(); ++i) {
      links.q.col(soft[i]) += d.x.col(static_cast<Index>(i));
      links.qd.col(soft[i]) += d.v.col(static_cast<Index>(i));
      links.qdd.col(soft[i]) += d.a.col(static_cast<Index>(i));
    }
    if (last) break;
    load = joint_loads(drives, dynamics, links)(Eigen::all, soft);
    for (Index k = 0; k < t.size(); ++k) load.row(k) -= d.a.row(k) * mass[static_cast<std::size_t>(k)];
  }
}

VectorXd increasing_times(const ExperimentInput& input) {
  const VectorXd t = input["t"];
  for (Index k = 1; k < t.size(); ++k)
    if (!(t[k] > t[k - 1]))
      input.fail("column 't', row " + std::to_string(k + 1) + ": does not increase, found " + std::to_string(t[k]) +
                 " after " + std::to_string(t[k - 1]));
  return t;
}

}  // namespace

namespace {

/// An arm with torque servos begins at rest where it was measured, or else at its first command.
ServoMotion servo_motion(const cell::Cell& cell, const ExperimentInput& input, const VectorXd& t) {
  input.need(!cell.robot.links.empty(), "robot.links");
  const MatrixXd command = input.joints("qc");
  VectorXd start = (input.has("q1") ? input.joints("q") : command).row(0).transpose();
  if (!start.allFinite()) start = command.row(0).transpose();
  const VectorXd gain = input.has(cell::servo_gain_column) ? VectorXd(input[cell::servo_gain_column]) : VectorXd();
  for (Index k = 0; k < gain.size(); ++k)
    if (!(gain[k] >= 0.0 && std::isfinite(gain[k])))
      input.fail("column '" + std::string(cell::servo_gain_column) + "', row " + std::to_string(k + 1) + ": found " +
                 std::to_string(gain[k]) + ", expected a gain, or 0 for motors that are off");
  return move_by_servos(cell, t, command, start, gain);
}

/// Torques of the servos as the drives show them: beside what turns the rotors, as currents where there are motors.
void add_servo_loads(const cell::Cell& cell, const ExperimentInput& input, const VectorXd& t, const ServoMotion& motion,
                     PredictionTable& out) {
  const physics::EffectiveDrives drives(cell);
  if (!drives.motors) return out.add_each("tau", motion.torque);
  const MatrixXd torque = motion.torque - motion.a * drives.rotor_matrix();
  const MatrixXd currents = delayed_log(t, drives.motors->currents(motion.a, torque), physics::current_delay(cell));
  out.add_each("i", currents);
  if (input.has("tau1")) out.add_each("tau", physics::reported_torques(cell, currents));
}

/// The wrench that the force sensor of an arm shows in a motion of its links.
MatrixXd sensed_wrench(const cell::Cell& cell, const ExperimentInput& input, const VectorXd& t, const Rows& wrench) {
  MatrixXd out = -wrench;
  physics::apply_sensor_effects(physics::WrenchSensor(cell), t, input.runs(), out);
  return out;
}

PredictionTable predict_servo_motion(const cell::Cell& cell, const ExperimentInput& input) {
  const VectorXd t = increasing_times(input);
  const ServoMotion motion = servo_motion(cell, input, t);
  PredictionTable out(t.size());
  out.add_each("q", motion.x);
  add_servo_loads(cell, input, t, motion, out);
  if (!cell.tool) return out;
  const physics::EffectiveArm arm(cell);
  const LinkMotion links = rigid_links(physics::EffectiveDrives(cell), {motion.x, motion.v, motion.a});
  kinematics::Dynamics dynamics = arm.dynamics((t[0] + t[t.size() - 1]) / 2);
  out.add_wrench(
      sensed_wrench(cell, input, t, dynamics.loads(links.q, links.qd, links.qdd, arm.below_sensor()).wrench));
  return out;
}

}  // namespace

PredictionTable predict_motion(const cell::Cell& cell, const ExperimentInput& input, MotionCache& cache) {
  const bool measured = input.joint_reference() == cell::JointReference::Measured;
  if (!measured && cell.has_torque_servos()) return predict_servo_motion(cell, input);
  input.need(measured || (cell.servo && !cell.servo->joint.empty()), "servo.joint");
  const bool massive = !cell.robot.links.empty();
  const VectorXd t = increasing_times(input);
  const physics::EffectiveArm arm(cell);
  const physics::EffectiveDrives drives(cell);
  const MatrixXd reference = input.joints("qc");
  const MotorMotion motor =
      measured ? measured_motion(reference, t, cache) : follow_commands(drives, reference, t, cache);
  PredictionTable out(t.size());
  if (!measured) out.add_each("q", motor.x);
  if (!massive && !cell.tool) return out;
  LinkMotion links = rigid_links(drives, motor);
  const double middle = (t[0] + t[t.size() - 1]) / 2;  // warms little in one motion
  kinematics::Dynamics dynamics = arm.dynamics(middle);
  if (!drives.rigid()) {
    input.need(massive, "robot.links");
    deflect_links(drives, dynamics, t, measured ? LoadBetweenRows::Linear : LoadBetweenRows::Smooth, links);
  }
  std::optional<kinematics::SensorCut> cut;
  if (cell.tool) cut = arm.below_sensor();
  const auto loads = cache.loads.find_or_make(load_key(arm.chain(middle), arm.bodies(), cell.robot.gravity, cut, links),
                                              [&] { return dynamics.loads(links.q, links.qd, links.qdd, cut); });
  if (massive) {
    Rows tau = loads->tau;
    add_cables(drives, links.q, tau);
    const MatrixXd torque = drives.drive_torques(t, motor.x, motor.v, tau);
    if (drives.motors) {
      const MatrixXd currents = delayed_log(t, drives.motors->currents(motor.a, torque), physics::current_delay(cell));
      out.add_each("i", currents);
      if (input.has("tau1")) out.add_each("tau", physics::reported_torques(cell, currents));
    } else {
      out.add_each("tau", torque);
    }
  }
  if (cell.tool) {
    out.add_wrench(sensed_wrench(cell, input, t, loads->wrench));
  }
  return out;
}

namespace {

/// z and its speed in each row, run by run.
Eigen::MatrixX2d follow_path(const cell::Cell& cell, const ExperimentInput& input,
                             const std::vector<physics::RowRange>& runs) {
  input.need(cell.servo && cell.servo->tool, "servo.tool");
  const physics::PathServo servo(cell);
  const auto asked = input["zc"];
  Eigen::MatrixX2d out(input.rows(), 2);
  for (const physics::RowRange& run : runs) {
    physics::PathCorrection path(servo, servo.start(asked[run.first]));
    for (Eigen::Index k = run.first; k < run.last; ++k) {
      out.row(k) << path.z(), path.speed();
      path.advance(asked[k]);
    }
  }
  return out;
}

}  // namespace

PredictionTable predict_step(const cell::Cell& cell, const ExperimentInput& input) {
  PredictionTable out(input.rows());
  out.add("z", follow_path(cell, input, input.runs()).col(0));
  return out;
}

PredictionTable predict_press(const cell::Cell& cell, const ExperimentInput& input) {
  input.need(cell.contact.has_value(), "contact");
  const std::vector<physics::RowRange> runs = input.runs();
  const Eigen::MatrixX2d path = follow_path(cell, input, runs);
  const physics::EffectiveContact contact(cell);
  PredictionTable out(input.rows());
  out.add("z", path.col(0));
  if (!cell.tool) return out;
  Eigen::MatrixXd wrench = physics::tool_weight(cell, input.rows());
  Eigen::MatrixX3d on_tool = Eigen::MatrixX3d::Zero(input.rows(), 3);
  for (Eigen::Index k = 0; k < input.rows(); ++k) on_tool(k, 2) = contact.force(-path(k, 0), -path(k, 1));
  wrench.leftCols<3>() += on_tool * physics::R_base_sensor_down();
  physics::apply_sensor_effects(physics::WrenchSensor(cell), input["t"], runs, wrench);
  out.add_wrench(wrench);
  return out;
}

namespace {

std::span<const double> as_span(const VectorXd& v) { return {v.data(), static_cast<std::size_t>(v.size())}; }

}  // namespace

PredictionTable predict_profile(const cell::Cell& cell, const ExperimentInput& input) {
  input.need(cell.contact.has_value(), "contact");
  input.need(cell.peg.has_value(), "peg");
  input.need(cell.tube.has_value(), "tube");
  const physics::EffectiveContact contact(cell);
  const VectorXd tilt = input["tilt"], alpha = input["alpha"], held = input["fc"];
  Eigen::MatrixX3d friction(input.rows(), 3);  // on the peg, in T
  VectorXd cx = input["cx"], cy = input["cy"];
  for (Index k = 0; k < input.rows(); ++k) {
    friction.row(k) = contact.rolling_friction(alpha[k], held[k]);
    const Eigen::Vector2d away = contact.lateral_displacement(friction.row(k));
    cx[k] += away.x(), cy[k] += away.y();
  }
  VectorXd z(input.rows());
  const force::PegTubeShape shape = physics::peg_tube_shape(cell);
  force::resting_heights({shape.peg_radius, shape.inner_radius, shape.outer_radius}, physics::T_tube_actual(cell),
                         as_span(tilt), as_span(alpha), as_span(cx), as_span(cy),
                         {z.data(), static_cast<std::size_t>(z.size())});
  for (Index k = 0; k < z.size(); ++k) z[k] -= contact.depth(held[k]);
  PredictionTable out(input.rows());
  out.add("z", z);
  if (!cell.tool) return out;
  Eigen::MatrixX3d on_peg = friction * cell.tube->T_base_tube.linear().transpose();
  on_peg.col(2) = held;
  Eigen::MatrixXd wrench = physics::tool_weight(cell, input.rows());
  wrench.leftCols<3>() += on_peg * physics::R_base_sensor_down();
  physics::apply_sensor_effects(physics::WrenchSensor(cell), input["t"], input.runs(), wrench);
  out.add_wrench(wrench);
  return out;
}

}  // namespace kr5::predict
