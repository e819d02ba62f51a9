// SPDX-License-Identifier: BSD-3-Clause
#include "scene_reference.hpp"

#include <cmath>
#include <numbers>

#include <kr5/core/error.hpp>
#include <kr5/robot/quintic_profile.hpp>

#include "ik_solver.hpp"

namespace kr5::sim {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

VectorXd solve_posture(const cell::Cell& cell, const Pose& T_base_flange, const VectorXd& near,
                       const std::string& field) {
  IkSolver ik(cell);
  const std::optional<VectorXd> found = ik.posture(T_base_flange, near);
  require(found.has_value(), field + ": the arm cannot reach it (" + std::string(name_of(ik.status())) + ")");
  return *found;
}

Pose T_tool_flange(const cell::Cell& cell) { return cell.tool ? cell.tool->T_flange_tool.inverse() : Pose::Identity(); }

void check_joints(const cell::Cell& cell, const std::string& field, const VectorXd& q, bool may_be_empty) {
  if (may_be_empty && q.size() == 0) return;
  require(q.size() == cell.robot.joints(), field + ": found " + std::to_string(q.size()) +
                                               " values, expected one a joint: " + std::to_string(cell.robot.joints()));
}

void check_limits(const cell::Cell& cell, const std::string& field, const VectorXd& q) {
  check_joints(cell, field, q, false);
  if (!cell.robot.limits) return;
  const cell::Limits& limits = *cell.robot.limits;
  for (Index i = 0; i < q.size(); ++i) {
    const bool good =
        (i >= limits.lower.size() || q[i] >= limits.lower[i]) && (i >= limits.upper.size() || q[i] <= limits.upper[i]);
    require(good, field + "[" + std::to_string(i) + "]: " + std::to_string(q[i]) + " is beyond robot.limits, " +
                      std::to_string(limits.lower[i]) + " to " + std::to_string(limits.upper[i]));
  }
}

VectorXd way_point_posture(const cell::Cell& cell, const WayPoint& point, const VectorXd& near,
                           const std::string& field) {
  require((point.q.size() > 0) + point.T_base_tool.has_value() + point.T_base_camera.has_value() == 1,
          field + ": expected one of q, T_B_E and T_B_C");
  if (point.T_base_tool) return solve_posture(cell, *point.T_base_tool * T_tool_flange(cell), near, field + ".T_B_E");
  if (!point.T_base_camera) {
    check_limits(cell, field + ".q", point.q);
    return point.q;
  }
  const std::optional<Pose> T_flange_camera = cell.camera ? cell::T_flange_camera(cell) : std::nullopt;
  require(T_flange_camera.has_value(), field + ".T_B_C: the cell has no camera on its flange");
  return solve_posture(cell, *point.T_base_camera * T_flange_camera->inverse(), near, field + ".T_B_C");
}

}  // namespace

SceneReference::SceneReference(const Scene& scene, const cell::Cell& cell) : c_(scene.controller) {
  start_ = scene.start.size() > 0 ? scene.start : VectorXd(VectorXd::Zero(cell.robot.joints()));
  if (scene.start_pose) start_ = solve_posture(cell, *scene.start_pose * T_tool_flange(cell), start_, "start_pose");
  check_limits(cell, "start", start_);
  check_joints(cell, "controller.amplitude", c_.amplitude, true);
  if (c_.target.size() > 0) check_limits(cell, "controller.target", c_.target);
  if (c_.amplitude.size() > 0) {
    check_limits(cell, "controller.amplitude: start - amplitude", start_ - c_.amplitude.cwiseAbs());
    check_limits(cell, "controller.amplitude: start + amplitude", start_ + c_.amplitude.cwiseAbs());
  }
  require(c_.target.size() == 0 || c_.way_points.empty(),
          "controller: found both target and way_points, expected one of them");
  require(c_.within >= 0.0 && c_.rest >= 0.0, "controller: within and rest must not be negative");
  for (std::size_t i = 0; i < c_.way_points.size(); ++i) {
    const std::string field = "controller.way_points[" + std::to_string(i) + "]";
    postures_.push_back(way_point_posture(cell, c_.way_points[i], i == 0 ? start_ : postures_.back(), field));
  }
  const double needed = (c_.within + c_.rest) * static_cast<double>(postures_.size());
  require(needed <= scene.duration + 1e-9, "duration: the way points take " + std::to_string(needed) + " s");
  if (c_.target.size() > 0) postures_.push_back(c_.target);
}

Eigen::VectorXd SceneReference::at(double t) const {
  VectorXd out = start_;
  for (std::size_t i = 0; i < postures_.size(); ++i)
    out += progress(t - static_cast<double>(i) * (c_.within + c_.rest)) *
           (postures_[i] - (i == 0 ? start_ : postures_[i - 1]));
  // The sine swells in over its first period, so that it starts from rest.
  const double turn = 2.0 * std::numbers::pi * c_.frequency * t;
  if (c_.amplitude.size() > 0) out += std::min(c_.frequency * t, 1.0) * std::sin(turn) * c_.amplitude;
  return out;
}

std::vector<double> SceneReference::rests() const {
  std::vector<double> out;
  for (std::size_t i = 0; i < c_.way_points.size(); ++i)
    out.push_back(static_cast<double>(i + 1) * (c_.within + c_.rest));
  return out;
}

double SceneReference::progress(double t) const {
  return t <= 0.0 ? 0.0 : robot::quintic_profile(t / c_.within).x;
}  // within may be 0

}  // namespace kr5::sim
