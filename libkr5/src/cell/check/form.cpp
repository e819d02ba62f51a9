// SPDX-License-Identifier: BSD-3-Clause
#include "cell/check/form.hpp"

#include <algorithm>

#include <kr5/cell/effect.hpp>

#include "cell/effect_rows.hpp"

namespace kr5::cell {
namespace {

/// A list of one value a joint.
void expect_size(DiagnosticCollector& c, const char* field, Eigen::Index size, int n, bool may_be_empty = false) {
  if (size == n || (may_be_empty && size == 0)) return;
  c.add(field, std::to_string(n) + " values, one a joint", std::to_string(size) + (size == 1 ? " value" : " values"));
}

void check_joint_names(const std::vector<std::string>& names, int joints, DiagnosticCollector& c) {
  if (names.empty()) return;
  if (static_cast<int>(names.size()) != joints)
    c.add("robot.joint_names", std::to_string(joints) + " names, one a joint",
          std::to_string(names.size()) + (names.size() == 1 ? " name" : " names"));
  for (std::size_t i = 0; i < names.size(); ++i) {
    const FieldPath field{"robot.joint_names", static_cast<Eigen::Index>(i)};
    c.expect(!names[i].empty(), field, "a name; leave the list out for joints without names", "an empty text");
    const auto first = std::find(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(i), names[i]);
    c.expect(
        names[i].empty() || first - names.begin() == static_cast<std::ptrdiff_t>(i), field,
        [&] { return "a name of its own; joint " + std::to_string(first - names.begin() + 1) + " has this one"; },
        [&] { return names[i]; });
  }
}

void check_arm(const Cell& cell, DiagnosticCollector& c) {
  const int n = cell.robot.joints();
  c.expect(n > 0, "robot.dh", "one row a joint");
  check_joint_names(cell.robot.joint_names, n, c);
  if (const auto& limits = cell.robot.limits) {
    expect_size(c, "robot.limits.lower", limits->lower.size(), n);
    expect_size(c, "robot.limits.upper", limits->upper.size(), n);
    expect_size(c, "robot.limits.velocity", limits->velocity.size(), n, true);
    expect_size(c, "robot.limits.effort", limits->effort.size(), n, true);
  }
  c.expect(!cell.robot.gears.stiffness.empty(), "robot.gears.stiffness",
           "at least one value; the last holds for further joints [N m/rad or N/m]", "an empty list");
  expect_size(c, "robot.links", static_cast<Eigen::Index>(cell.robot.links.size()), n, true);
  if (const auto& drives = cell.drives) {
    c.expect(
        drives->structure.rows() == n && drives->structure.cols() == n, "drives.structure",
        [&] { return "a " + std::to_string(n) + " x " + std::to_string(n) + " matrix"; },
        [&] { return std::to_string(drives->structure.rows()) + " x " + std::to_string(drives->structure.cols()); });
    expect_size(c, "drives.rotor_inertia", drives->rotor_inertia.size(), n);
    expect_size(c, "drives.torque_constant", drives->torque_constant.size(), n);
    expect_size(c, "drives.friction.coulomb", drives->friction.coulomb.size(), n);
    expect_size(c, "drives.friction.viscous", drives->friction.viscous.size(), n);
  }
  if (cell.servo && cell.servo->joint.size() > 1)
    expect_size(c, "servo.joint", static_cast<Eigen::Index>(cell.servo->joint.size()), n);
  if (cell.servo && cell.servo->torque.size() > 1)
    expect_size(c, "servo.torque", static_cast<Eigen::Index>(cell.servo->torque.size()), n);
  c.expect(!cell.servo || cell.servo->torque.empty() || cell.servo->joint.empty(), "servo.torque",
           "either torque servos (servo.torque) or joint servos (servo.joint)", "both");
}

void check_mounts(const Cell& cell, DiagnosticCollector& c) {
  const auto one_of = [&](const FieldPath& field, int count, const char* names) {
    c.expect(
        count == 1, field, [&] { return std::string("exactly one of ") + names; },
        [&] { return std::to_string(count) + " of them"; });
  };
  if (const auto& camera = cell.camera) {
    if (camera->mount == Mount::EyeInHand) {
      one_of("camera", camera->T_tool_camera.has_value() + camera->T_flange_camera.has_value(),
             "T_E_C, T_F_C (mount: flange)");
      c.expect(!camera->T_base_camera, "camera.T_B_C", "T_E_C or T_F_C, or mount: base");
    } else {
      one_of("camera", camera->T_base_camera.has_value(), "T_B_C (mount: base)");
      c.expect(!camera->T_tool_camera, "camera.T_E_C", "T_B_C alone (mount: base)");
      c.expect(!camera->T_flange_camera, "camera.T_F_C", "T_B_C alone (mount: base)");
    }
    c.expect(!camera->T_tool_camera || cell.tool, "camera.T_E_C", "a tool with T_F_E, to which it refers; or T_F_C");
  }
  if (const auto& laser = cell.laser) {
    one_of("laser", laser->T_tool_scanner.has_value() + laser->T_flange_scanner.has_value(), "T_E_L, T_F_L");
    c.expect(!laser->T_tool_scanner || cell.tool, "laser.T_E_L", "a tool with T_F_E, to which it refers; or T_F_L");
  }
  for (std::size_t i = 0; i < cell.targets.size(); ++i)
    one_of({"targets", static_cast<Eigen::Index>(i)},
           cell.targets[i].T_base_target.has_value() + cell.targets[i].T_flange_target.has_value(), "T_B_W, T_F_W");
}

void check_effect_targets(const Cell& cell, DiagnosticCollector& c) {
  for (const ActiveEffect& active : active_effects(cell.effects)) {
    const std::vector<std::string> there = effect_targets(find_effect(active.id), cell);
    if (std::find(there.begin(), there.end(), active.target) != there.end()) continue;
    c.add("effects." + active.id + "." + active.target,
          there.empty() ? "no such effect; this cell has no possible target for it" : "one of " + listed(there),
          "the target '" + active.target + "'");
  }
  for (const EffectEntry& entry : cell.effects.entries()) {
    const Effect& row = find_effect(entry.effect);
    for (const EffectParameter& p : row.parameters) {
      const auto value = cell.effects.find(entry.effect, p.name, entry.index);
      if (!value || !p.refers_to) continue;
      const double number = std::get<double>(*value);
      const int count = target_count(*p.refers_to, cell);
      if (number >= 0 && number < count) continue;
      c.add("effects." + entry.effect + "." + target_name(row.target, entry.index) + "." + p.name,
            "a " + p.description + ", 0 to " + std::to_string(count - 1));
    }
  }
}

}  // namespace

void check_form(const Cell& cell, DiagnosticCollector& c) {
  check_arm(cell, c);
  check_mounts(cell, c);
  check_effect_targets(cell, c);
}

}  // namespace kr5::cell
