// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/test_motion.hpp>

#include <cmath>
#include <numbers>

#include <kr5/core/error.hpp>
#include <kr5/rsi/controller_state.hpp>

#include "rsi/wire_units.hpp"

namespace kr5::rsi {
namespace {

constexpr double longest_pause = 0.1;  // between telegrams, after which the arm may be elsewhere [s]
constexpr double way_back = 0.3;       // time in which a motion that is given up is taken back [s]

}  // namespace

void TestMotionOptions::validate() const {
  require(angle > 0 && angle <= degree * (1 + 1e-9), "angle: must be positive, at most 1 degree [rad]");
  require(translation > 0 && translation <= 0.005, "translation: must be positive, at most 5 mm [m]");
  require(duration >= 0.4 && duration <= 60, "duration: must lie between 0.4 and 60 s [s]");
  require(rest >= 0.2 && rest <= 60, "rest: must lie between 0.2 and 60 s [s]");
  require(abort_ratio > 1 && abort_ratio <= 10, "abort_ratio: must lie between 1 and 10 [-]");
}

TestMotion::TestMotion(const TelegramLayout& layout, robot::CommandFrame frame, const TestMotionOptions& options)
    : frame_(frame), options_(options) {
  options_.validate();
  const TelegramUnits units(layout);
  require(units.corrects_joints() || units.corrects_tool(),
          "receive: the layout has no correction (AKorr or RKorr) by which the arm could be moved");
  joints_ = units.corrects_joints();
}

double TestMotion::demand(double time, int& component) const noexcept {
  const double each = options_.rest + options_.duration;
  component = static_cast<int>(time / each);
  const double within =
      time - component * each - 0.5 * options_.rest;  // rest on both sides, so that it ends where it began
  if (component >= 6 || within <= 0 || within >= options_.duration) return 0.0;
  const double s = std::sin(std::numbers::pi * within / options_.duration);
  return size_of(component) * s * s;
}

bool TestMotion::moved_too_far(const robot::RobotReading& now) const noexcept {
  const double angle = options_.abort_ratio * options_.angle, way = options_.abort_ratio * options_.translation;
  if (joints_) return !((now.joints - first_->joints).cwiseAbs().head(6).maxCoeff() <= angle);
  const Pose moved = first_->T_base_tool.inverse() * now.T_base_tool;
  return !(moved.translation().norm() <= way && log_rotation(moved.linear()).norm() <= angle);
}

robot::RobotCommand TestMotion::command(int component, double way) const noexcept {
  if (joints_) {
    robot::RobotCommand out;
    out.space = robot::CommandSpace::Joints;
    out.mode = robot::CommandMode::Relative;
    out.joints = robot::JointVector::Zero(first_->joints.size());
    out.joints[component] = way;
    return out;
  }
  Vector6 motion = Vector6::Zero();
  motion[component] = way;
  return robot::tool_motion(to_pose(motion), frame_);
}

robot::RobotCommand TestMotion::step(const robot::RobotReading& reading) noexcept {
  if (over_) return {};
  if (!first_) {
    first_ = reading;
    last_time_ = reading.time;
  }
  const bool same = reading.joints.size() == first_->joints.size() && (!joints_ || reading.joints.size() >= 6);
  if (!same || reading.status.stopped || std::abs(reading.time - last_time_) > longest_pause) {
    aborted_ = over_ = true;
    return {};
  }
  last_time_ = reading.time;
  const double time = reading.time - first_->time, before = value_;
  if (!aborted_ && moved_too_far(reading)) {
    aborted_ = true;
    abort_time_ = time;
    abort_value_ = value_;
  }
  if (aborted_) {
    const double left = 1.0 - (time - abort_time_) / way_back;
    value_ = left > 0 ? abort_value_ * left * left * (3 - 2 * left) : 0.0;
    over_ = left <= 0;
  } else {
    value_ = demand(time, component_);
    over_ = component_ >= 6;
  }
  return component_ < 6 ? command(component_, value_ - before) : robot::RobotCommand();
}

}  // namespace kr5::rsi
