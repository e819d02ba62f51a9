// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/correction_limits.hpp>

#include <cmath>
#include <numbers>
#include <string>

#include <kr5/core/error.hpp>

#include "rsi/tool_correction.hpp"

namespace kr5::rsi {
namespace {

constexpr double exact = 1e-9;  // below what a telegram shows [rad or m]

constexpr double uncorrected = 1e-4;  // between setpoints and measured values of a standing arm [rad or m]

bool is_free(const MotionLimits& rotation) { return rotation.total >= std::numbers::pi; }

/// The rotation of a correction.
Eigen::Matrix3d turned(const Pose& path, const Pose& corrected, robot::CommandFrame frame) noexcept {
  if (frame == robot::CommandFrame::Tool) return path.linear().transpose() * corrected.linear();
  return corrected.linear() * path.linear().transpose();
}

void check_limits(const MotionLimits& limits, const std::string& field) {
  try {
    limits.validate();
  } catch (const InvalidArgument& e) {
    throw InvalidArgument(field + "." + e.what());
  }
}

}  // namespace

void CorrectionLimits::validate() const {
  check_limits(axis, "axis");
  for (std::size_t i = 0; i < axes.size(); ++i) check_limits(axes[i], "axes[" + std::to_string(i) + "]");
  check_limits(translation, "translation");
  check_limits(rotation, "rotation");
  require(
      rotation.total < 1.5 || is_free(rotation),
      "rotation.total: must be below 1.5 rad, where a rotation vector is no longer unique, or at least pi, which is "
      "no limit");
}

PathCorrection::PathCorrection(const TelegramLayout& layout, const CorrectionLimits& limits, robot::CommandMode mode,
                               robot::CommandFrame frame, double cycle)
    : units_(layout), mode_(mode), frame_(frame) {
  limits.validate();
  const auto joints = static_cast<std::size_t>(units_.joints());
  require(limits.axes.empty() || limits.axes.size() == joints,
          "axes: expected the limits of " + std::to_string(joints) + " joints, or none");
  for (std::size_t i = 0; i < tool_at; ++i)
    limiters_.emplace_back(i < limits.axes.size() ? limits.axes[i] : limits.axis, cycle);
  for (int i = 0; i < 6; ++i) limiters_.emplace_back(i < 3 ? limits.translation : limits.rotation, cycle);
  if (is_free(limits.rotation)) rotation_.emplace(limits.rotation, cycle);
}

bool PathCorrection::is_told_by(const ControllerState& first) const noexcept {
  if (units_.corrects_joints() == units_.corrects_tool()) return true;
  if (units_.corrects_tool())
    return !first.tool || !first.tool_setpoint ||
           tool_correction(*first.tool_setpoint, *first.tool, frame_).cwiseAbs().maxCoeff() < uncorrected;
  return first.joint_setpoints.size() != units_.joints() || first.joints.size() != units_.joints() ||
         (first.joints - first.joint_setpoints).cwiseAbs().maxCoeff() < uncorrected;
}

bool PathCorrection::is_standing(const ControllerState& first, const ControllerState& state) const noexcept {
  if (units_.corrects_tool())
    return first.tool_setpoint && state.tool_setpoint &&
           tool_correction(*first.tool_setpoint, *state.tool_setpoint, frame_).cwiseAbs().maxCoeff() < exact;
  return first.joint_setpoints.size() == state.joint_setpoints.size() &&
         (state.joint_setpoints - first.joint_setpoints).cwiseAbs().maxCoeff() < exact;
}

void PathCorrection::begin(const ControllerState& first, const ControllerState& state) noexcept {
  for (MotionLimiter& limiter : limiters_) limiter.stand(0.0);
  if (rotation_) rotation_->stand(Eigen::Matrix3d::Identity());
  if (!is_told_by(first) && is_standing(first, state)) stand_as_measured(state);
  start_joints_ = state.joints;
  start_tool_ = state.tool;
  outcome_ = CommandOutcome::Braked;
}

void PathCorrection::stand_as_measured(const ControllerState& state) noexcept {
  if (units_.corrects_joints() && state.joint_setpoints.size() == units_.joints() &&
      state.joints.size() == units_.joints())
    for (int i = 0; i < units_.joints(); ++i)
      limiters_[static_cast<std::size_t>(i)].stand(state.joints[i] - state.joint_setpoints[i]);
  if (!units_.corrects_tool() || !state.tool || !state.tool_setpoint) return;
  const Vector6 made = tool_correction(*state.tool_setpoint, *state.tool, frame_);
  for (int i = 0; i < 6; ++i) limiters_[tool_at + static_cast<std::size_t>(i)].stand(made[i]);
  if (rotation_) rotation_->stand(turned(*state.tool_setpoint, *state.tool, frame_));
}

robot::JointVector PathCorrection::joints() const noexcept {
  robot::JointVector out(units_.joints());
  for (int i = 0; i < units_.joints(); ++i) out[i] = limiters_[static_cast<std::size_t>(i)].value();
  return out;
}

Vector6 PathCorrection::tool() const noexcept {
  Vector6 out;
  for (int i = 0; i < 6; ++i) out[i] = limiters_[tool_at + static_cast<std::size_t>(i)].value();
  if (rotation_) out.tail<3>() = log_rotation(rotation_->value());
  return out;
}

void PathCorrection::brake(std::size_t first, std::size_t count) noexcept {
  for (std::size_t i = first; i < first + count; ++i) limiters_[i].brake();
}

void PathCorrection::brake_tool() noexcept {
  brake(tool_at, 6);
  if (rotation_) rotation_->brake();
}

/// Whether the demand was met.
bool PathCorrection::go(std::size_t limiter, double demand, robot::CommandMode mode) noexcept {
  MotionLimiter& of = limiters_[limiter];
  if (mode == robot::CommandMode::Relative)
    of.move(demand - of.value());
  else
    of.follow(demand);
  return std::abs(of.value() - demand) < exact;
}

bool PathCorrection::step_joints(const robot::RobotCommand& command, const ControllerState& state) noexcept {
  const robot::JointVector& path = state.joint_setpoints.size() > 0 ? state.joint_setpoints : start_joints_;
  const bool usable = units_.corrects_joints() && path.size() == units_.joints() && path.allFinite() &&
                      command.joints.size() == path.size() && command.joints.allFinite();
  if (!usable) return false;
  const robot::JointVector now = path + joints();
  const robot::JointVector wanted = robot::commanded_joints(command, now);
  bool met = true;
  for (int i = 0; i < units_.joints(); ++i)
    met = go(static_cast<std::size_t>(i), wanted[i] - path[i], command.mode) && met;
  brake_tool();
  outcome_ = met ? CommandOutcome::Followed : CommandOutcome::Limited;
  return true;
}

Pose PathCorrection::corrected(const Pose& path) const noexcept {
  const Pose correction = to_pose(tool());
  if (frame_ == robot::CommandFrame::Tool) return path * correction;
  Pose out = path;
  out.translation() += correction.translation();
  out.linear() = correction.linear() * path.linear();
  return out;
}

bool PathCorrection::turn(const Pose& path, const Pose& wanted, robot::CommandMode mode) noexcept {
  const Eigen::Matrix3d demand = turned(path, wanted, frame_);
  return mode == robot::CommandMode::Relative ? rotation_->move(demand) : rotation_->follow(demand);
}

bool PathCorrection::step_tool(const robot::RobotCommand& command, const ControllerState& state) noexcept {
  const std::optional<Pose>& path = state.tool_setpoint ? state.tool_setpoint : start_tool_;
  const bool usable = units_.corrects_tool() && path && path->matrix().allFinite() &&
                      command.tool.matrix().allFinite() && is_rotation(command.tool.linear());
  if (!usable) return false;
  const Pose wanted = robot::commanded_tool(command, corrected(*path));
  const Vector6 demand = tool_correction(*path, wanted, frame_);
  bool met = !rotation_ || turn(*path, wanted, command.mode);
  for (int i = 0; i < (rotation_ ? 3 : 6); ++i)
    met = go(tool_at + static_cast<std::size_t>(i), demand[i], command.mode) && met;
  brake(0, static_cast<std::size_t>(units_.joints()));
  outcome_ = met ? CommandOutcome::Followed : CommandOutcome::Limited;
  return true;
}

Correction PathCorrection::result(const robot::JointVector& joints_before, const Vector6& tool_before) const noexcept {
  const bool relative = mode_ == robot::CommandMode::Relative;
  Correction out;
  out.gripper = gripper_;
  if (units_.corrects_joints()) out.joints = relative ? robot::JointVector(joints() - joints_before) : joints();
  if (!units_.corrects_tool()) return out;
  const Pose after = to_pose(tool()), before = to_pose(tool_before);
  out.tool = after;
  if (relative && frame_ == robot::CommandFrame::Tool) out.tool = before.inverse() * after;
  if (relative && frame_ == robot::CommandFrame::Base) {
    out.tool->translation() -= before.translation();
    out.tool->linear() = after.linear() * before.linear().transpose();
  }
  return out;
}

Correction PathCorrection::hold() noexcept {
  const robot::JointVector joints_before = joints();
  const Vector6 tool_before = tool();
  brake(0, tool_at);
  brake_tool();
  outcome_ = CommandOutcome::Braked;
  return result(joints_before, tool_before);
}

Correction PathCorrection::step(const robot::RobotCommand& command, const ControllerState& state) noexcept {
  gripper_ = command.gripper;
  if (command.stop || command.space == robot::CommandSpace::None) return hold();
  const robot::JointVector joints_before = joints();
  const Vector6 tool_before = tool();
  if (command.space == robot::CommandSpace::Joints ? step_joints(command, state) : step_tool(command, state))
    return result(joints_before, tool_before);
  const Correction out = hold();
  outcome_ = CommandOutcome::Refused;
  return out;
}

}  // namespace kr5::rsi
