// SPDX-License-Identifier: BSD-3-Clause
#include "scene_arm.hpp"

#include <kr5/core/error.hpp>
#include <kr5/physics/contact.hpp>
#include <kr5/sim/driven_arm.hpp>

#include "cycle_steps.hpp"
#include "scene_reference.hpp"
#include "scene_rows.hpp"
#include "scene_sensors.hpp"

namespace kr5::sim {
namespace {

using Eigen::VectorXd;

/// What touches the tool.
Environment scene_environment(const Scene& scene, const cell::Cell& cell) {
  const bool pushed = scene.objects.push != Eigen::Vector3d::Zero();
  if (!scene.objects.bench && !pushed) return {};
  require(cell.tool.has_value(), "objects: a bench or a push needs a tool, which the cell does not have");
  require(!scene.objects.bench || cell.contact, "objects.bench: the cell has no contact");
  const Pose T_sensor_tool = cell.tool->T_flange_sensor.inverse() * cell.tool->T_flange_tool;
  std::optional<physics::EffectiveContact> contact;
  if (scene.objects.bench) contact.emplace(cell);
  return [=, objects = scene.objects](const Pose& T_base_sensor, const Vector6& velocity, double t) {
    Vector6 wrench = Vector6::Zero();
    if (t >= objects.push_at) wrench.head<3>() = objects.push;
    if (!contact) return wrench;
    const Eigen::Vector3d arm = T_base_sensor.linear() * T_sensor_tool.translation();
    const double speed = (velocity.head<3>() + velocity.tail<3>().cross(arm)).z();
    const double depth = *objects.bench - (T_base_sensor.translation() + arm).z();
    const Eigen::Vector3d force(0.0, 0.0, contact->force(depth, -speed));
    wrench.head<3>() += force;
    wrench.tail<3>() += arm.cross(force);
    return wrench;
  };
}

std::vector<std::string> scene_columns(const cell::Cell& cell, bool scanner) {
  std::vector<std::string> out = {"t"};
  const int n = cell.robot.joints();
  for (const char* name : {"q", "link"})
    for (int i = 1; i <= n; ++i) out.push_back(name + std::to_string(i));
  if (cell.drives)
    for (int i = 1; i <= n; ++i) out.push_back("i" + std::to_string(i));
  if (cell.tool)
    for (const char* name : {"fx", "fy", "fz", "tx", "ty", "tz", "x", "y", "z"}) out.push_back(name);
  out.insert(out.end(), {"energy", "limited"});
  if (scanner) out.push_back("range");
  return out;
}

std::vector<double> arm_row(const cell::Cell& cell, DrivenArm& arm) {
  const ArmReading now = arm.read();
  std::vector<double> out = {now.t};
  out.insert(out.end(), now.position.begin(), now.position.end());
  out.insert(out.end(), now.link.begin(), now.link.end());
  out.insert(out.end(), now.current.begin(), now.current.end());
  if (cell.tool) {
    out.insert(out.end(), now.wrench.begin(), now.wrench.end());
    const Eigen::Vector3d tip = (arm.arm().T_base_flange() * cell.tool->T_flange_tool).translation();
    out.insert(out.end(), tip.begin(), tip.end());
  }
  out.push_back(arm.energy());
  out.push_back(now.limited ? 1.0 : 0.0);
  return out;
}

}  // namespace

void run_arm_scene(const Scene& scene, const cell::Cell& cell, SceneResult& out) {
  const SceneReference reference(scene, cell);
  const Controller& c = scene.controller;
  if (c.kind == ControllerKind::Limited)
    require(c.current_limit.size() > 0, "controller.current_limit: is missing, which kind limited needs");
  const DrivenArmOptions options{scene.step, c.kind == ControllerKind::Limited ? c.current_limit : VectorXd()};
  DrivenArm arm(cell, options);
  arm.reset(reference.start());
  arm.set_environment(scene_environment(scene, cell));
  SceneSensors sensors(scene, cell, reference.rests());
  RowTable rows(scene_columns(cell, scene.scanner.has_value()));
  const double cycle = scene_cycle(scene, cell);
  std::size_t event = 0;
  for (double t = 0.0; t < scene.duration + 1e-9; t += cycle) {
    if (event < scene.events.size() && scene.events[event].at <= t) {
      out.cell.effects = scene.events[event++].effects;
      const VectorXd place = arm.read().position;
      arm = DrivenArm(out.cell, options);
      arm.reset(place, t);
      arm.set_environment(scene_environment(scene, out.cell));
      sensors.set_cell(out.cell);
    }
    std::vector<double> row = arm_row(out.cell, arm);
    sensors.sample(t, arm);
    if (scene.scanner) row.push_back(sensors.range());
    rows.add(std::move(row));
    const int count = divide_cycle(arm, cycle);
    for (int i = 1; i <= count; ++i, ++out.steps) {
      const double late = arm.drives().servo.empty() ? 0.0 : arm.drives().servo.front().delay;
      if (c.kind == ControllerKind::Servo) arm.follow(reference.at(t + i * cycle / count - late));
      if (c.kind == ControllerKind::Limited) arm.follow_limited(reference.at(t + i * cycle / count - late));
      if (c.kind == ControllerKind::Off) arm.drive(VectorXd::Zero(cell.robot.joints()));
    }
  }
  out.rows = rows.table();
  sensors.report(out);
}

}  // namespace kr5::sim
