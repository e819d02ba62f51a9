// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <numbers>

#include <kr5/core/error.hpp>
#include <kr5/kinematics/inverse.hpp>
#include <kr5/predict/contact.hpp>
#include <kr5/sim/driven_arm.hpp>

#include "scene_run.hpp"

namespace kr5::sim {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

kinematics::InverseOptions within_limits(const cell::Cell& cell) {
  kinematics::InverseOptions options;
  if (!cell.robot.limits) return options;
  options.lower = cell.robot.limits->lower;
  options.upper = cell.robot.limits->upper;
  return options;
}

VectorXd start_of(const Scene& scene, const cell::Cell& cell) {
  if (scene.start_pose) {
    const Pose T_B_F = *scene.start_pose * (cell.tool ? cell.tool->T_F_E.inverse() : Pose::Identity());
    const kinematics::InverseResult found = kinematics::inverse(cell::chain(cell), T_B_F, within_limits(cell));
    require(found.status == kinematics::InverseStatus::Solved,
            "start_pose: the arm cannot take it (" + std::string(name_of(found.status)) + ")");
    return found.postures.front().q;
  }
  return scene.start.size() > 0 ? scene.start : VectorXd(VectorXd::Zero(cell.robot.joints()));
}

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

/// Where the controller wants the joints.
class Wish {
 public:
  Wish(const Scene& scene, const cell::Cell& cell, VectorXd start) : c_(scene.controller), start_(std::move(start)) {
    check_limits(cell, "start", start_);
    check_joints(cell, "controller.amplitude", c_.amplitude, true);
    if (c_.target.size() > 0) check_limits(cell, "controller.target", c_.target);
    if (c_.amplitude.size() > 0) {
      check_limits(cell, "controller.amplitude: start - amplitude", start_ - c_.amplitude.cwiseAbs());
      check_limits(cell, "controller.amplitude: start + amplitude", start_ + c_.amplitude.cwiseAbs());
    }
  }

  VectorXd at(double t) const {
    VectorXd out = start_;
    if (c_.target.size() > 0) out += way(t) * (c_.target - start_);
    // The sine swells in over its first period, so that it starts from rest.
    const double turn = 2.0 * std::numbers::pi * c_.frequency * t;
    if (c_.amplitude.size() > 0) out += std::min(c_.frequency * t, 1.0) * std::sin(turn) * c_.amplitude;
    return out;
  }
  const VectorXd& start() const { return start_; }

 private:
  double way(double t) const {
    if (t <= 0.0) return 0.0;
    if (t >= c_.within) return 1.0;
    const double s = t / c_.within;
    return s * s * s * (10.0 + s * (6.0 * s - 15.0));  // speed and acceleration begin and end at zero
  }

  const Controller& c_;
  VectorXd start_;
};

/// What touches the tool.
Environment environment(const Scene& scene, const cell::Cell& cell) {
  const bool pushed = scene.objects.push != Eigen::Vector3d::Zero();
  if (!scene.objects.bench && !pushed) return {};
  require(cell.tool.has_value(), "objects: a cell without tool touches nothing");
  require(!scene.objects.bench || cell.contact, "objects.bench: the cell has no contact");
  const Pose T_S_E = cell.tool->T_F_S.inverse() * cell.tool->T_F_E;
  std::optional<predict::RealContact> contact;
  if (scene.objects.bench) contact.emplace(cell);
  return [=, objects = scene.objects](const Pose& T_B_S, const Vector6& velocity, double t) {
    Vector6 wrench = Vector6::Zero();
    if (t >= objects.push_at) wrench.head<3>() = objects.push;
    if (!contact) return wrench;
    const Eigen::Vector3d arm = T_B_S.linear() * T_S_E.translation();
    const double speed = (velocity.head<3>() + velocity.tail<3>().cross(arm)).z();
    const double depth = *objects.bench - (T_B_S.translation() + arm).z();
    const Eigen::Vector3d force(0.0, 0.0, contact->force(depth, -speed));
    wrench.head<3>() += force;
    wrench.tail<3>() += arm.cross(force);
    return wrench;
  };
}

std::vector<std::string> column_names(const cell::Cell& cell) {
  std::vector<std::string> out = {"t"};
  const int n = cell.robot.joints();
  for (const char* name : {"q", "link"})
    for (int i = 1; i <= n; ++i) out.push_back(name + std::to_string(i));
  if (cell.drives)
    for (int i = 1; i <= n; ++i) out.push_back("i" + std::to_string(i));
  if (cell.tool)
    for (const char* name : {"fx", "fy", "fz", "tx", "ty", "tz", "x", "y", "z"}) out.push_back(name);
  out.insert(out.end(), {"energy", "limited"});
  return out;
}

std::vector<double> row_of(const cell::Cell& cell, DrivenArm& arm) {
  const ArmReading now = arm.read();
  std::vector<double> out = {now.t};
  out.insert(out.end(), now.position.begin(), now.position.end());
  out.insert(out.end(), now.link.begin(), now.link.end());
  out.insert(out.end(), now.current.begin(), now.current.end());
  if (cell.tool) {
    out.insert(out.end(), now.wrench.begin(), now.wrench.end());
    const Eigen::Vector3d tip = (arm.arm().T_B_F() * cell.tool->T_F_E).translation();
    out.insert(out.end(), tip.begin(), tip.end());
  }
  out.push_back(arm.energy());
  out.push_back(now.limited ? 1.0 : 0.0);
  return out;
}

}  // namespace

io::Table run_arm(const Scene& scene, const cell::Cell& cell, int& steps) {
  const Wish wish(scene, cell, start_of(scene, cell));
  const Controller& c = scene.controller;
  if (c.kind == ControllerKind::Limited)
    require(c.current_limit.size() > 0, "controller.current_limit: kind limited needs one");
  const DrivenArmOptions options{scene.step, c.kind == ControllerKind::Limited ? c.current_limit : VectorXd()};
  DrivenArm arm(cell, options);
  arm.reset(wish.start());
  arm.set_environment(environment(scene, cell));
  cell::Cell now = cell;
  Rows rows(column_names(cell));
  const double cycle = scene_cycle(cell);
  std::size_t event = 0;
  for (double t = 0.0; t < scene.duration + 1e-9; t += cycle) {
    if (event < scene.events.size() && scene.events[event].at <= t) {
      now.effects = scene.events[event++].effects;
      const VectorXd place = arm.read().position;
      arm = DrivenArm(now, options);
      arm.reset(place, t);
      arm.set_environment(environment(scene, now));
    }
    rows.add(row_of(now, arm));
    const auto count = static_cast<int>(std::ceil(cycle / arm.step() - 1e-6));
    arm.set_step(cycle / count);
    for (int i = 1; i <= count; ++i, ++steps) {
      const double late = arm.drives().servo.empty() ? 0.0 : arm.drives().servo.front().delay;
      if (c.kind == ControllerKind::Servo) arm.follow(wish.at(t + i * cycle / count - late));
      if (c.kind == ControllerKind::Limited) arm.follow_limited(wish.at(t + i * cycle / count - late));
      if (c.kind == ControllerKind::Off) arm.drive(VectorXd::Zero(cell.robot.joints()));
    }
  }
  return rows.table();
}

}  // namespace kr5::sim
