// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/robot/loopback.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <kr5/core/error.hpp>
#include <kr5/kinematics/inverse.hpp>

namespace kr5::robot {

void LoopbackOptions::validate() const {
  require(cycle > 0 && std::isfinite(cycle), "cycle: must be positive [s]");
  require(delay >= 0 && delay <= 1000 * cycle, "delay: must lie between 0 and a thousand cycles [s]");
  limits.validate();
  for (const auto& [value, name] : {std::pair{joint_noise, "joint_noise"}, std::pair{position_noise, "position_noise"},
                                    std::pair{rotation_noise, "rotation_noise"}, std::pair{force_noise, "force_noise"},
                                    std::pair{torque_noise, "torque_noise"}})
    require(value >= 0 && std::isfinite(value), std::string(name) + ": must not be negative");
}

LoopbackRobot::LoopbackRobot(const LoopbackOptions& options, const SensorModel& model)
    : options_(options), model_(model), random_(options.seed) {
  options_.validate();
  model_.validate();
  delay_cycles_ = static_cast<std::size_t>(std::max(1L, std::lround(options_.delay / options_.cycle)));
  if (has_arm()) place(JointVector::Zero(static_cast<Eigen::Index>(model_.arm.joints.size())));
}

void LoopbackRobot::place(const JointVector& joints) {
  require(joints.allFinite(), "joints: must be finite [rad or m]");
  T_base_tool_ = model_.arm.flange(joints) * model_.T_flange_tool;
  joints_ = joints;
  coming_.clear();
  status_.reachable = true;
}

void LoopbackRobot::place(const Pose& T_base_tool) {
  require(T_base_tool.matrix().allFinite() && is_rotation(T_base_tool.linear()), "T_base_tool: must be a rigid motion");
  require(!has_arm() || reach(T_base_tool), "T_base_tool: the arm does not reach this pose");
  T_base_tool_ = T_base_tool;
  coming_.clear();
  status_.reachable = true;
}

void LoopbackRobot::set_status(bool saturated, bool gripped) noexcept {
  status_.saturated = saturated;
  status_.gripped = gripped;
}

bool LoopbackRobot::reach(const Pose& T_base_tool) {
  kinematics::InverseOptions options;
  options.near = joints_;
  const auto found =
      kinematics::inverse_kinematics(model_.arm, T_base_tool * model_.T_flange_tool.inverse(), options).nearest();
  if (found) joints_ = *found;
  return found.has_value();
}

RobotReading LoopbackRobot::read() {
  const Pose T_base_flange = T_base_tool_ * model_.T_flange_tool.inverse();
  SensorValues values;
  values.time = time_;
  values.status = status_;
  values.sensor =
      sensed_wrench(model_, T_base_flange, environment_ ? environment_(T_base_tool_) : Vector6(Vector6::Zero()));
  for (Eigen::Index i = 0; i < 6; ++i)
    values.sensor[i] += random_.normal(i < 3 ? options_.force_noise : options_.torque_noise);
  if (has_arm()) {
    values.joints = joints_;
    for (double& value : values.joints) value += random_.normal(options_.joint_noise);
    return robot_reading(model_, values);
  }
  Vector6 off;
  for (Eigen::Index i = 0; i < 6; ++i)
    off[i] = random_.normal(i < 3 ? options_.position_noise : options_.rotation_noise);
  return robot_reading(model_, values, T_base_tool_ * to_pose(off) * model_.T_flange_tool.inverse());
}

void LoopbackRobot::obey(RobotCommand command) {
  command.limits = command.limits.within(options_.limits);
  gripper_ = command.gripper;
  status_.stopped = command.stop;
  if (command.stop || command.space == CommandSpace::None) return;
  if (command.space == CommandSpace::Joints) {
    status_.reachable = has_arm() && command.joints.size() == joints_.size() && command.joints.allFinite();
    if (!status_.reachable) return;
    joints_ = commanded_joints(command, joints_);
    T_base_tool_ = model_.arm.flange(joints_) * model_.T_flange_tool;
    return;
  }
  const Pose next = commanded_tool(command, T_base_tool_);
  status_.reachable = command.tool.matrix().allFinite() && (!has_arm() || reach(next));
  if (status_.reachable) T_base_tool_ = next;
}

void LoopbackRobot::send(const RobotCommand& command) {
  coming_.push_back(command);
  if (coming_.size() >= delay_cycles_) {
    obey(std::move(coming_.front()));
    coming_.pop_front();
  }
  time_ += options_.cycle;
}

}  // namespace kr5::robot
