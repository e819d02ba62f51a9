// SPDX-License-Identifier: BSD-3-Clause
#include "insertion_arm.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <kr5/cell/sensor_model.hpp>
#include <kr5/core/error.hpp>
#include <kr5/geometry/tilt.hpp>
#include <kr5/physics/tool.hpp>
#include <kr5/physics/tube.hpp>

#include "cycle_steps.hpp"

namespace kr5::sim {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using std::numbers::pi;

Grip grip_of(const cell::Cell& cell, const InsertionSetup& setup, const Pose& T_actual_base) {
  const force::GripModel believed = believed_grip(cell, setup);
  Random random(setup.seed * 2 + 3);
  const double factor = setup.noise ? std::max(1 + random.normal(setup.stiffness_error), 0.1) : 1.0;
  const auto limit = [](double value) { return value > 0 ? value : std::numeric_limits<double>::infinity(); };
  return {.lateral = factor * believed.lateral,
          .angular = factor * believed.angular,
          .height = believed.height,
          .gravity = T_actual_base.linear() * cell.robot.gravity,
          .force = limit(setup.grip_force),
          .torque = limit(setup.grip_torque)};
}

WristSensorOptions sensor_of(const InsertionSetup& setup) {
  WristSensorOptions out;
  out.noise = setup.noise;
  out.seed = setup.seed * 2 + 1;
  return out;
}

}  // namespace

force::GripModel believed_grip(const cell::Cell& cell, const InsertionSetup& setup) {
  const double height = 0.8 * cell.peg->length;
  return {.axial = cell.contact->stiffness,
          .lateral = setup.lateral_stiffness > 0 ? setup.lateral_stiffness : cell.contact->stiffness,
          .angular = setup.angular_stiffness,
          .height = height,
          .tilt_uncertainty = setup.noise ? std::hypot(setup.grip_tilt, setup.tube_tilt) : 0.0,
          .position_uncertainty =
              setup.noise ? std::hypot(setup.grip_error, setup.repeatability / 3, height * setup.grip_tilt) : 0.0};
}

InsertionArm::InsertionArm(const cell::Cell& real, const InsertionSetup& setup)
    : cell_(real),
      setup_(setup),
      random_(setup.seed),
      jitter_(setup.seed * 2 + 4),
      ik_(real),
      arm_(real),
      peg_(real, grip_of(real, setup, (real.tube->T_base_tube * physics::T_tube_actual(real)).inverse())),
      sensor_(real, sensor_of(setup)),
      encoders_(arm_.drives(), 0.0, setup.noise ? real.noise.position : 0.0, setup.seed * 2 + 2),
      currents_(real, setup.noise, setup.seed),
      believed_(cell::sensor_model(real)),
      cycle_(real.servo->cycle),
      T_base_tube_(real.tube->T_base_tube),
      T_tube_actual_(physics::T_tube_actual(real)),
      T_actual_base_((T_base_tube_ * T_tube_actual_).inverse()),
      wander_(setup.repeatability),
      lead_(*real.servo, cycle_) {
  relative_ = cell_.servo->correction && cell_.servo->correction->mode == cell::CorrectionMode::Relative;
  arm_.set_environment([this](const Pose&, const Vector6&, double) { return on_tool_; });
  regrip();
}

InsertionArm::Coordinates InsertionArm::coordinates(const Pose& T_tube_peg) {
  Coordinates out;
  out << T_tube_peg.translation(), tilt_of(T_tube_peg);
  return out;
}

Pose InsertionArm::flange_for(const Pose& T_tube_peg) const {
  return T_base_tube_ * T_tube_peg * T_peg_tool_ * cell_.tool->T_flange_tool.inverse();
}

void InsertionArm::regrip() {
  grip_ = Pose::Identity();
  if (!setup_.noise) return;
  wander_.draw(random_);
  grip_.translation() << random_.normal(setup_.grip_error), random_.normal(setup_.grip_error), 0.0;
  grip_.linear() = exp_rotation({random_.normal(setup_.grip_tilt), random_.normal(setup_.grip_tilt), 0.0});
}

/// How the grip is turned about the peg: so that the arm can do the whole task, and its joints move least in it.
bool InsertionArm::choose_turn(const Pose& T_tube_peg, double tilt) {
  double least = std::numeric_limits<double>::infinity();
  Pose best = T_peg_tool_;
  VectorXd chosen;
  for (int turn = 0; turn < 12; ++turn) {
    T_peg_tool_ = Pose::Identity();
    T_peg_tool_.linear() =
        (Eigen::AngleAxisd(turn * pi / 6, Vector3d::UnitZ()) * Eigen::AngleAxisd(pi, Vector3d::UnitX()))
            .toRotationMatrix();
    std::optional<VectorXd> q = ik_.posture(flange_for(T_tube_peg), VectorXd::Zero(cell_.robot.joints()));
    double greatest = 0.0;
    for (int k = 0; k < 8 && q; ++k) {
      const Vector3d below = T_tube_peg.translation() - Vector3d(0, 0, 0.05);
      const Pose leaned = tilted_pose(below, tilt_vector(tilt, k * pi / 4));
      const std::optional<VectorXd> other = ik_.posture(flange_for(leaned), *q);
      greatest = other ? std::max(greatest, (*other - *q).lpNorm<Eigen::Infinity>()) : 1e9;
      if (!other) q.reset();
    }
    if (!q || greatest >= least) continue;
    least = greatest;
    best = T_peg_tool_;
    chosen = *q;
  }
  T_peg_tool_ = best;
  if (chosen.size() > 0) lead_.start(chosen);
  return std::isfinite(least);
}

bool InsertionArm::start(const Pose& T_tube_peg, double tilt) {
  if (!choose_turn(T_tube_peg, tilt)) return false;
  const Coordinates at = seen_ = coordinates(T_tube_peg);
  T_base_asked_ = force::T_base_tool(frames(), T_tube_peg);
  servo_.clear();
  if (cell_.servo->tool) {
    const physics::PathServo position(cell_);
    physics::PathServo rotation = position;  // the limits of a file are those of positions
    rotation.correction.per_cycle.reset();
    rotation.correction.total.reset();
    for (int i = 0; i < 5; ++i) servo_.emplace_back(i < 3 ? position : rotation, at[i]);
  }
  command_ = lead_.q();
  arm_.reset(command_);
  reading_ = arm_.read();
  held_ = held();
  peg_.place(held_);
  return true;
}

/// What becomes of a command behind the servo of the path.
Pose InsertionArm::commanded(const Pose& T_tube_peg) {
  const Coordinates command = coordinates(T_tube_peg);
  Coordinates out = command;
  for (std::size_t i = 0; i < servo_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    servo_[i].advance(relative_ ? command[k] - seen_[k] : command[k]);
    out[k] = servo_[i].z();
  }
  return tilted_pose(out.head<3>(), out.tail<2>());
}

Pose InsertionArm::held() {
  return wander_.applied(T_actual_base_ * arm_.arm().T_base_flange() * physics::tool_offset(cell_) *
                         T_peg_tool_.inverse() * grip_);
}

/// The peg through a time in which the grip goes steadily to where it is now.
void InsertionArm::move_peg(const Pose& to, double passed) {
  Vector6 velocity;
  velocity << to.translation() - held_.translation(), log_rotation(to.linear() * held_.linear().transpose());
  velocity /= passed;
  const int steps = static_cast<int>(std::ceil(passed / peg_.longest_step() - 1e-6));
  const double step = passed / steps;
  const Eigen::Matrix3d turn = exp_rotation(velocity.tail<3>() * step);
  Pose now = held_;
  for (int i = 0; i < steps; ++i) {
    now.translation() += step * velocity.head<3>();
    now.linear() = turn * now.linear();
    peg_.advance(now, velocity, step);
  }
  held_ = to;
  const Vector6& felt = peg_.on_grip();
  const Eigen::Matrix3d R_base_actual = T_actual_base_.linear().transpose();
  const Vector3d force = R_base_actual * felt.head<3>();
  const Vector3d at = T_actual_base_.inverse() * to.translation();
  on_tool_ << force, R_base_actual * felt.tail<3>() + (at - arm_.arm().T_base_sensor().translation()).cross(force);
  arm_.environment_changed();
}

void InsertionArm::hold_peg() { peg_.place(held_); }

/// Joint values that a command asks for, if the arm has them; without a target those of the last pose.
std::optional<VectorXd> InsertionArm::asked(const robot::RobotCommand& command) {
  if (command.space == robot::CommandSpace::Joints) return VectorXd(robot::commanded_joints(command, told_.joints));
  if (command.space == robot::CommandSpace::Tool) T_base_asked_ = robot::commanded_tool(command, told_.T_base_tool);
  return ik_.posture(flange_for(commanded(T_base_tube_.inverse() * T_base_asked_ * T_peg_tool_.inverse())), lead_.q());
}

void InsertionArm::send(const robot::RobotCommand& command) {
  const VectorXd before = command_;
  stopped_ = command.stop;
  if (!stopped_) {
    const std::optional<VectorXd> q = asked(command);
    reachable_ = q.has_value();
    command_ = lead_.next(reachable_ ? *q : lead_.q());
  } else {
    command_ = lead_.q();
  }
  peg_.hold(command.gripper.hold, command.gripper.air);
  const double passes = cycle_ + (setup_.cycle_jitter > 0 ? jitter_.uniform(-1, 1) * setup_.cycle_jitter : 0.0);
  follow_cycle(arm_, before, command_, passes, [&](double passed) {
    if (setup_.noise) wander_.pass(passed, random_);
    reading_ = arm_.read();
    move_peg(held(), passed);
  });
  time_ += passes;
}

robot::RobotReading InsertionArm::read() {
  reading_ = arm_.read();
  robot::SensorValues values;
  values.time = time_;
  values.joints = robot::joint_vector(encoders_.read(reading_.position));
  values.currents = robot::joint_vector(currents_.read(reading_.current));
  values.sensor = sensor_.read(reading_.wrench, time_);
  values.status = {stopped_, reachable_, sensor_.saturated(), peg_.gripped()};
  told_ = robot::robot_reading(believed_, values);
  seen_ = coordinates(force::T_tube_peg(frames(), told_));
  return told_;
}

}  // namespace kr5::sim
