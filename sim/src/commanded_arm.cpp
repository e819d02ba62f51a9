// SPDX-License-Identifier: BSD-3-Clause
#include "commanded_arm.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <kr5/cell/sensor_model.hpp>
#include <kr5/core/error.hpp>
#include <kr5/physics/tool.hpp>

#include "cycle_steps.hpp"

namespace kr5::sim {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double longest_jump = 0.5;  // of a joint in a cycle: beyond it the arm would turn over [rad or m]

WristSensorOptions noisy_sensor(const CommandedArmOptions& options) {
  WristSensorOptions out;
  out.noise = options.noise;
  out.seed = options.seed * 2 + 1;
  return out;
}

}  // namespace

CommandedArm::CommandedArm(const cell::Cell& real, const cell::Cell& believed, const CommandedArmOptions& options)
    : cell_(real),
      options_(options),
      random_(options.seed),
      ik_(real),
      arm_(real),
      sensor_(real, noisy_sensor(options)),
      encoders_(arm_.drives(), 0.0, options.noise ? real.noise.position : 0.0, options.seed * 2 + 2),
      currents_(real, options.noise, options.seed),
      believed_(cell::sensor_model(believed)),
      wander_(options.repeatability),
      lead_(*real.servo, real.servo->cycle),
      cycle_(real.servo->cycle) {
  relative_ = cell_.servo->correction && cell_.servo->correction->mode == cell::CorrectionMode::Relative;
  delay_cycles_ = static_cast<std::size_t>(std::max(std::lround(cell_.servo->of_joint(0).delay / cycle_), 0L));
  arm_.set_environment([this](const Pose&, const Vector6&, double) { return touch_; });
  if (options_.noise) wander_.draw(random_);
  place(VectorXd::Zero(cell_.robot.joints()));
}

void CommandedArm::place(const VectorXd& joints) {
  require(joints.size() == cell_.robot.joints() && joints.allFinite(),
          "joints: " + std::to_string(cell_.robot.joints()) + " finite joint values are needed");
  lead_.start(joints);
  command_ = joints;
  path_.clear();
  coming_.assign(delay_cycles_, joints);
  wrenches_.clear();
  arm_.reset(joints, time_);
  stopped_ = read_ = false;
  reachable_ = true;
}

/// The path begins where the joints were last asked to be, at rest.
void CommandedArm::begin_path() {
  const Pose T_base_tool = ik_.chain().flange(lead_.q()) * cell_.tool->T_flange_tool;
  T_base_asked_ = T_base_tool;
  turned_ = T_base_tool.linear();
  path_.clear();
  if (!cell_.servo->tool) return;
  const physics::PathServo position(cell_);
  physics::PathServo rotation = position;  // the limits of a file are those of positions
  rotation.correction = {.mode = cell::CorrectionMode::Relative};
  for (int i = 0; i < 6; ++i)
    path_.emplace_back(i < 3 ? position : rotation, i < 3 ? T_base_tool.translation()[i] : 0.0);
}

/// What becomes of a command behind the servo of the path. Rotations are corrected from where the tool is turned to
/// now, so that no angle is too large.
Pose CommandedArm::served(const Pose& asked) {
  Pose out = asked;
  const Vector3d turn = log_rotation(asked.linear() * turned_.transpose());
  Vector3d step;
  for (int i = 0; i < 3; ++i) {
    physics::PathCorrection& along = path_[static_cast<std::size_t>(i)];
    along.advance(asked.translation()[i] - (relative_ ? told_.T_base_tool.translation()[i] : 0.0));
    out.translation()[i] = along.z();
    physics::PathCorrection& about = path_[static_cast<std::size_t>(i) + 3];
    const double before = about.z();
    about.advance(turn[i]);
    step[i] = about.z() - before;
  }
  turned_ = nearest_rotation(exp_rotation(step) * turned_);
  out.linear() = turned_;
  return out;
}

std::optional<VectorXd> CommandedArm::posture(const Pose& T_base_tool) {
  std::optional<VectorXd> q = ik_.posture(T_base_tool * cell_.tool->T_flange_tool.inverse(), lead_.q());
  if (q && (*q - lead_.q()).lpNorm<Eigen::Infinity>() > longest_jump) q.reset();
  return q;
}

/// Setpoints behind the delay of the joints, for commands that no path correction takes.
VectorXd CommandedArm::delayed(const VectorXd& q) {
  coming_.push_back(q);
  const VectorXd out = coming_.front();
  coming_.pop_front();
  return out;
}

/// What the servos of the joints are told for a command, if the arm can go there; without a target the last one.
std::optional<VectorXd> CommandedArm::asked(const robot::RobotCommand& command) {
  if (command.space == robot::CommandSpace::Joints) {
    path_.clear();
    return VectorXd(robot::commanded_joints(command, told_.joints));
  }
  if (command.space == robot::CommandSpace::Tool) {
    if (path_.empty()) begin_path();
    T_base_asked_ = robot::commanded_tool(command, told_.T_base_tool);
    return posture(path_.empty() ? T_base_asked_ : served(T_base_asked_));
  }
  return path_.empty() ? VectorXd(lead_.q()) : posture(served(T_base_asked_));
}

void CommandedArm::send(const robot::RobotCommand& command, const Moved& moved) {
  if (!read_) read(false);
  const VectorXd before = command_;
  stopped_ = command.stop;
  if (stopped_) {
    path_.clear();
    lead_.start(lead_.q());
    coming_.assign(delay_cycles_, lead_.q());
    command_ = lead_.q();
  } else {
    const std::optional<VectorXd> q = asked(command);
    reachable_ = q.has_value();
    const VectorXd wanted = reachable_ ? *q : lead_.q();
    if (!path_.empty()) {
      command_ = lead_.next(wanted);
      coming_.assign(delay_cycles_, wanted);
    } else {
      lead_.start(delayed(wanted));
      command_ = lead_.q();
    }
  }
  follow(before, moved);
  time_ += cycle_;
  read_ = false;
}

void CommandedArm::follow(const VectorXd& before, const Moved& moved) {
  follow_cycle(arm_, before, command_, cycle_, [&](double passed) {
    if (options_.noise) wander_.pass(passed, random_);
    arm_.read();
    moved(passed);
  });
}

void CommandedArm::touch(const Vector6& wrench) {
  touch_ = wrench;
  arm_.environment_changed();
}

Pose CommandedArm::T_base_flange() { return wander_.applied(arm_.arm().T_base_flange()); }
Pose CommandedArm::T_base_tool() { return T_base_flange() * physics::tool_offset(cell_); }

/// What the sensor felt at the time that it tells now, interpolated.
Vector6 CommandedArm::late_wrench() {
  wrenches_.push_back({time_, arm_.read().wrench});
  const double due = time_ - options_.force_delay;
  while (wrenches_.size() > 2 && wrenches_[1].t <= due) wrenches_.pop_front();
  const TimedWrench& a = wrenches_.front();
  if (wrenches_.size() == 1 || due <= a.t) return a.wrench;
  const TimedWrench& b = wrenches_[1];
  const double share = std::min((due - a.t) / (b.t - a.t), 1.0);
  return a.wrench + share * (b.wrench - a.wrench);
}

const robot::RobotReading& CommandedArm::read(bool gripped) {
  if (read_) return told_;
  read_ = true;
  const ArmReading& now = arm_.read();
  robot::SensorValues values;
  values.time = time_;
  values.joints = robot::joint_vector(encoders_.read(now.position));
  values.currents = robot::joint_vector(currents_.read(now.current));
  values.sensor = sensor_.read(late_wrench(), time_);
  values.status = {stopped_, reachable_, sensor_.saturated(), gripped};
  return told_ = robot::robot_reading(believed_, values);
}

CommandedArmState CommandedArm::state() const {
  CommandedArmState out;
  out.time = time_;
  out.arm = arm_.state();
  out.sensor = sensor_.state();
  out.encoders = encoders_.state();
  out.currents = currents_.state();
  out.random = random_.state();
  out.wander = wander_.off();
  out.q = lead_.q();
  out.speed = lead_.speed();
  out.command = command_;
  out.coming.assign(coming_.begin(), coming_.end());
  for (const physics::PathCorrection& axis : path_) out.path.push_back(axis.state());
  out.turned = turned_;
  out.T_base_asked = T_base_asked_;
  out.told_joints = told_.joints;
  out.T_base_told = told_.T_base_tool;
  out.wrenches.assign(wrenches_.begin(), wrenches_.end());
  out.touch = touch_;
  out.reachable = reachable_;
  return out;
}

void CommandedArm::restore(const CommandedArmState& state) {
  const Eigen::Index joints = cell_.robot.joints();
  require(state.q.size() == joints && state.speed.size() == joints && state.command.size() == joints,
          "arm.q: " + std::to_string(joints) + " joint values are needed");
  require(state.coming.size() == delay_cycles_, "arm.coming: does not match the delay of the joints");
  require(state.path.empty() || (state.path.size() == 6 && cell_.servo->tool), "arm.path: does not match the servo");
  arm_.restore(state.arm);
  sensor_.restore(state.sensor);
  encoders_.restore(state.encoders);
  currents_.restore(state.currents);
  random_.restore(state.random);
  wander_.restore(state.wander);
  lead_.start(state.q);
  path_.clear();
  if (!state.path.empty()) begin_path();
  for (std::size_t i = 0; i < path_.size(); ++i) path_[i].restore(state.path[i]);
  lead_.restore(state.q, state.speed);
  command_ = state.command;
  coming_.assign(state.coming.begin(), state.coming.end());
  turned_ = state.turned;
  T_base_asked_ = state.T_base_asked;
  told_.joints = robot::joint_vector(state.told_joints);
  told_.T_base_tool = state.T_base_told;
  wrenches_.assign(state.wrenches.begin(), state.wrenches.end());
  touch_ = state.touch;
  arm_.environment_changed();
  time_ = state.time;
  stopped_ = false;  // a stop is a command, and ends with the program that gave it
  reachable_ = state.reachable;
  read_ = false;
}

}  // namespace kr5::sim
