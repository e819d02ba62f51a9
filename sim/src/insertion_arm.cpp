// SPDX-License-Identifier: BSD-3-Clause
#include "insertion_arm.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <kr5/core/error.hpp>
#include <kr5/geometry/tilt.hpp>

namespace kr5::sim {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using std::numbers::pi;

constexpr double wandering = 1.5;  // time in which the arm forgets how far it was off [s]
constexpr double lever = 0.5;      // over which the same errors turn the tool [m]

Grip grip_of(const cell::Cell& cell, const InsertionSetup& setup, const Pose& T_tube_B) {
  const force::GripModel believed = believed_grip(cell, setup);
  Random random(setup.seed * 2 + 3);
  const double factor = setup.noise ? std::max(1 + random.normal(setup.stiffness_error), 0.1) : 1.0;
  return {.lateral = factor * believed.lateral,
          .angular = factor * believed.angular,
          .height = believed.height,
          .gravity = T_tube_B.linear() * cell.robot.gravity};
}

force::WrenchConditionerOptions weight_of(const cell::Cell& cell) {
  force::WrenchConditionerOptions out;
  out.cycle = cell.servo->cycle;
  out.mass = cell.tool->mass;
  out.com = cell.tool->com;
  out.gravity = cell.robot.gravity;
  return out;
}

WristSensorOptions sensor_of(const InsertionSetup& setup) {
  WristSensorOptions out;
  out.noise = setup.noise;
  out.seed = setup.seed * 2 + 1;
  return out;
}

}  // namespace

InsertionArm::InsertionArm(const cell::Cell& real, const InsertionSetup& setup)
    : cell_(real),
      setup_(setup),
      random_(setup.seed),
      reach_(real),
      arm_(real),
      peg_(real, grip_of(real, setup, (real.tube->T_B_T * predict::real_tube(real.effects.task)).inverse())),
      sensor_(real, sensor_of(setup)),
      encoders_(arm_.drives(), 0.0, setup.noise ? real.noise.position : 0.0, setup.seed * 2 + 2),
      weight_(weight_of(real)),
      cycle_(real.servo->cycle),
      T_B_T_(real.tube->T_B_T),
      T_T_tube_(predict::real_tube(real.effects.task)),
      T_tube_B_((T_B_T_ * T_T_tube_).inverse()) {
  relative_ = cell_.servo->correction && cell_.servo->correction->mode == cell::CorrectionMode::Relative;
  arm_.set_environment([this](const Pose&, const Vector6&, double) { return on_tool_; });
  regrip();
}

InsertionArm::Coordinates InsertionArm::coordinates(const Pose& T_T_P) {
  Coordinates out;
  out << T_T_P.translation(), tilt_of(T_T_P);
  return out;
}

Pose InsertionArm::flange_for(const Pose& T_T_P) const { return T_B_T_ * T_T_P * T_P_E_ * cell_.tool->T_F_E.inverse(); }

void InsertionArm::regrip() {
  grip_ = Pose::Identity();
  if (!setup_.noise) return;
  for (int i = 0; i < 6; ++i) off_[i] = random_.normal(setup_.repeatability / 3 / (i < 3 ? 1.0 : lever));
  grip_.translation() << random_.normal(setup_.grip_error), random_.normal(setup_.grip_error), 0.0;
  grip_.linear() = exp_rotation({random_.normal(setup_.grip_tilt), random_.normal(setup_.grip_tilt), 0.0});
}

/// How the grip is turned about the peg: so that the arm can do the whole task, and its joints move least in it.
bool InsertionArm::choose_turn(const Pose& T_T_P, double tilt) {
  double least = std::numeric_limits<double>::infinity();
  Pose best = T_P_E_;
  for (int turn = 0; turn < 12; ++turn) {
    T_P_E_ = Pose::Identity();
    T_P_E_.linear() = (Eigen::AngleAxisd(turn * pi / 6, Vector3d::UnitZ()) * Eigen::AngleAxisd(pi, Vector3d::UnitX()))
                          .toRotationMatrix();
    std::optional<VectorXd> q = reach_.posture(flange_for(T_T_P), VectorXd::Zero(cell_.robot.joints()));
    double greatest = 0.0;
    for (int k = 0; k < 8 && q; ++k) {
      const Vector3d below = T_T_P.translation() - Vector3d(0, 0, 0.05);
      const Pose leaned = tilted_pose(below, tilt_vector(tilt, k * pi / 4));
      const std::optional<VectorXd> other = reach_.posture(flange_for(leaned), *q);
      greatest = other ? std::max(greatest, (*other - *q).lpNorm<Eigen::Infinity>()) : 1e9;
      if (!other) q.reset();
    }
    if (!q || greatest >= least) continue;
    least = greatest;
    best = T_P_E_;
    q_ = *q;
  }
  T_P_E_ = best;
  return std::isfinite(least);
}

bool InsertionArm::start(const Pose& T_T_P, double tilt) {
  if (!choose_turn(T_T_P, tilt)) return false;
  const Coordinates at = seen_ = coordinates(T_T_P);
  servo_.clear();
  if (cell_.servo->tool) {
    const predict::PathServo position(cell_);
    predict::PathServo rotation = position;  // the limits of a file are those of positions
    rotation.correction.per_cycle.reset();
    rotation.correction.total.reset();
    for (int i = 0; i < 5; ++i) servo_.emplace_back(i < 3 ? position : rotation, at[i]);
  }
  speed_ = VectorXd::Zero(q_.size());
  command_ = q_;
  arm_.reset(q_);
  reading_ = arm_.read();
  held_ = held();
  peg_.place(held_);
  return true;
}

/// What becomes of a command behind the servo of the path.
Pose InsertionArm::commanded(const Pose& T_T_P) {
  const Coordinates command = coordinates(T_T_P);
  Coordinates out = command;
  for (std::size_t i = 0; i < servo_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    servo_[i].advance(relative_ ? command[k] - seen_[k] : command[k]);
    out[k] = servo_[i].z();
  }
  return tilted_pose(out.head<3>(), out.tail<2>());
}

/// The servo of the path is what was measured of the whole arm, joint servos in it: these are told ahead of time.
VectorXd InsertionArm::led_ahead(const VectorXd& q) {
  const VectorXd speed = (q - q_) / cycle_;
  VectorXd out = q;
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    const cell::SecondOrder& servo = cell_.servo->of_joint(static_cast<int>(i));
    const double w = servo.natural_frequency;
    out[i] += 2 * servo.damping_ratio / w * speed[i] + (speed[i] - speed_[i]) / cycle_ / (w * w);
  }
  q_ = q;
  speed_ = speed;
  return out;
}

void InsertionArm::wander(double passed) {
  if (!setup_.noise) return;
  const double keep = std::exp(-passed / wandering), fresh = std::sqrt(1 - keep * keep);
  for (int i = 0; i < 6; ++i)
    off_[i] = keep * off_[i] + random_.normal(fresh * setup_.repeatability / 3 / (i < 3 ? 1.0 : lever));
}

Pose InsertionArm::held() {
  Pose tip = cell_.tool->T_F_E;
  tip.translate(cell_.effects.tool.offset);
  Pose T_tube_P = T_tube_B_ * arm_.arm().T_B_F() * tip * T_P_E_.inverse() * grip_;
  T_tube_P.translation() += off_.head<3>();
  T_tube_P.linear() = exp_rotation(off_.tail<3>()) * T_tube_P.linear();
  return T_tube_P;
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
  const Eigen::Matrix3d R_B_tube = T_tube_B_.linear().transpose();
  const Vector3d force = R_B_tube * felt.head<3>();
  const Vector3d at = T_tube_B_.inverse() * to.translation();
  on_tool_ << force, R_B_tube * felt.tail<3>() + (at - arm_.arm().T_B_S().translation()).cross(force);
  arm_.environment_changed();
}

void InsertionArm::hold_peg() { peg_.place(held_); }

void InsertionArm::advance(const force::InsertionCommand& command) {
  const VectorXd before = command_;
  if (!command.stop) {
    const std::optional<VectorXd> q = reach_.posture(flange_for(commanded(command.T_T_P)), q_);
    reachable_ = q.has_value();
    command_ = led_ahead(reachable_ ? *q : q_);
  } else {
    command_ = q_;
  }
  peg_.hold(command.hold, command.air);
  const int steps = static_cast<int>(std::ceil(cycle_ / arm_.step() - 1e-6));
  arm_.set_step(cycle_ / steps);
  // Gears that give way swing against the contact: peg and arm then take turns step by step.
  const bool stiff = arm_.drives().rigid();
  for (int i = 1; i <= steps; ++i) {
    arm_.follow(before + (command_ - before) * i / steps);
    if (stiff && i < steps) continue;
    const double passed = stiff ? cycle_ : cycle_ / steps;
    wander(passed);
    reading_ = arm_.read();
    move_peg(held(), passed);
  }
  time_ += cycle_;
}

force::InsertionReading InsertionArm::read() {
  force::InsertionReading out;
  reading_ = arm_.read();
  const Pose T_B_F = reach_.chain().flange(encoders_.read(reading_.position));
  const Pose T_T_F = T_B_T_.inverse() * T_B_F;
  out.T_T_P = T_T_F * cell_.tool->T_F_E * T_P_E_.inverse();
  seen_ = coordinates(out.T_T_P);
  out.sensor = sensor_.read(reading_.wrench, time_);
  const Pose T_T_S = T_T_F * cell_.tool->T_F_S;
  const Vector6 felt = out.sensor - weight_.weight(T_B_F.linear() * cell_.tool->T_F_S.linear());
  const Vector3d force = T_T_S.linear() * felt.head<3>();
  out.wrench << force, T_T_S.linear() * felt.tail<3>() + (T_T_S.translation() - out.T_T_P.translation()).cross(force);
  current_.assign(reading_.current.begin(), reading_.current.end());
  out.current = current_;
  out.saturated = sensor_.saturated();
  out.gripped = peg_.gripped();
  out.reachable = reachable_;
  return out;
}

}  // namespace kr5::sim
