// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/fold_effects.hpp>

#include <algorithm>
#include <functional>
#include <iterator>
#include <string_view>
#include <vector>

#include <kr5/physics/camera.hpp>
#include <kr5/physics/contact.hpp>
#include <kr5/physics/effective_arm.hpp>
#include <kr5/physics/friction.hpp>
#include <kr5/physics/joint_drive.hpp>
#include <kr5/physics/motors.hpp>
#include <kr5/physics/scanner.hpp>
#include <kr5/physics/servo.hpp>
#include <kr5/physics/tool.hpp>
#include <kr5/physics/torque_servo.hpp>
#include <kr5/physics/tube.hpp>

namespace kr5::physics {
namespace {

using cell::ActiveEffect;
using cell::Cell;
using kinematics::DhJoint;

DhJoint& row_of(Cell& cell, int joint) { return cell.robot.dh[static_cast<std::size_t>(joint)]; }

cell::Link& link_of(Cell& cell, int joint) { return cell.robot.links[static_cast<std::size_t>(joint)]; }

bool slides(const Cell& cell, int joint) {
  return cell.robot.dh[static_cast<std::size_t>(joint)].type == kinematics::JointType::Prismatic;
}

/// A joint reads zero elsewhere; the dress pack, whose rest is a value of the link, with it.
void put_encoder_offset(const Cell& from, int joint, Cell& to) {
  const double offset = encoder_offset(from, joint);
  (slides(from, joint) ? row_of(to, joint).b : row_of(to, joint).theta_offset) += offset;
  if (!to.effects.carries("cable_spring", joint)) return;
  const double rest = to.effects.number("cable_spring", "rest", joint);
  to.effects.set("cable_spring", "joint" + std::to_string(joint + 1), "rest", rest - offset);
}

void put_camera_mount(const Cell& from, int, Cell& to) {
  const Pose T_flange_camera = hand_eye(from);
  if (to.camera->T_tool_camera)
    to.camera->T_tool_camera = to.tool->T_flange_tool.inverse() * T_flange_camera;
  else
    to.camera->T_flange_camera = T_flange_camera;
}

void put_scanner_mount(const Cell& from, int, Cell& to) {
  const Pose T_flange_scanner = laser_mount(from);
  if (to.laser->T_tool_scanner)
    to.laser->T_tool_scanner = to.tool->T_flange_tool.inverse() * T_flange_scanner;
  else
    to.laser->T_flange_scanner = T_flange_scanner;
}

/// Camera and scanner that are given from the tip stay where they are on the flange.
void put_tool_offset(const Cell& from, int, Cell& to) {
  const Pose before = to.tool->T_flange_tool;
  to.tool->T_flange_tool = tool_offset(from);
  const Pose T_after_before = to.tool->T_flange_tool.inverse() * before;
  if (to.camera && to.camera->T_tool_camera) to.camera->T_tool_camera = T_after_before * *to.camera->T_tool_camera;
  if (to.laser && to.laser->T_tool_scanner) to.laser->T_tool_scanner = T_after_before * *to.laser->T_tool_scanner;
}

void put_payload(const Cell& from, int, Cell& to) {
  const kinematics::Body body = payload(from);
  to.tool->mass = body.mass;
  to.tool->com = body.com;
  to.tool->inertia = body.inertia;
}

/// One servo for all joints becomes one a joint.
void put_joint_servo(const Cell& from, int joint, Cell& to) {
  to.servo->joint.resize(static_cast<std::size_t>(to.robot.joints()), to.servo->joint.front());
  to.servo->joint[static_cast<std::size_t>(joint)].natural_frequency = joint_servo(from, joint);
}

/// The same of torque servos.
void put_torque_servo(const Cell& from, int joint, Cell& to) {
  const double delay = to.servo->torque_of(joint).delay;  // has its own place
  to.servo->torque.resize(static_cast<std::size_t>(to.robot.joints()), to.servo->torque.front());
  cell::TorqueServo& servo = to.servo->torque[static_cast<std::size_t>(joint)];
  servo = torque_servo(from, joint);
  servo.delay = delay;
}

void put_joint_delay(const Cell& from, int, Cell& to) {
  for (std::size_t i = 0; i < to.servo->torque.size(); ++i)
    to.servo->torque[i].delay = torque_servo_delay(from, static_cast<int>(i));
  for (std::size_t i = 0; i < to.servo->joint.size(); ++i)
    to.servo->joint[i].delay = joint_delay(from, static_cast<int>(i));
}

/// Where an effect has its place, and how its law puts it there.
struct Place {
  std::string_view effect;
  std::string_view field;  ///< Of the cell; `[]` is the number of the joint or motor.
  std::function<void(const Cell& from, int index, Cell& to)> put;
  std::string_view parameter = {};  ///< The only one that has a place; empty: all.
};

/// Places that stand for themselves.
std::vector<Place> own_places() {
  return {
      Place{"base_tilt", "robot.T_B_0",
            [](const Cell& from, int, Cell& to) { to.robot.T_base_0 = base_tilt(from) * to.robot.T_base_0; }},
      Place{"link_length", "robot.dh[]",
            [](const Cell& from, int i, Cell& to) { row_of(to, i) = link_length(from, i, row_of(to, i)); }},
      Place{"link_twist", "robot.dh[]",
            [](const Cell& from, int i, Cell& to) { row_of(to, i) = link_twist(from, i, row_of(to, i)); }},
      Place{"encoder_offset", "robot.dh[]", &put_encoder_offset},
      Place{"coulomb_friction", "drives.friction.coulomb[]",
            [](const Cell& from, int i, Cell& to) { to.drives->friction.coulomb[i] = coulomb_friction(from, i); }},
      Place{"viscous_friction", "drives.friction.viscous[]",
            [](const Cell& from, int i, Cell& to) { to.drives->friction.viscous[i] = viscous_friction(from, i); }},
      Place{"torque_constant", "drives.torque_constant[]",
            [](const Cell& from, int i, Cell& to) { to.drives->torque_constant[i] = torque_constant(from)[i]; }},
      Place{"rotor_inertia", "drives.rotor_inertia[]",
            [](const Cell& from, int i, Cell& to) { to.drives->rotor_inertia[i] = rotor_inertia(from)[i]; }},
      Place{"wrist_coupling", "drives.structure[]",
            [](const Cell& from, int i, Cell& to) { to.drives->structure.row(i) = wrist_coupling(from).row(i); }},
      Place{"joint_servo", "servo.joint[]", &put_joint_servo},
      Place{"joint_delay", "servo.joint", &put_joint_delay},
      Place{"servo_stiffness", "servo.torque[].stiffness", &put_torque_servo},
      Place{"servo_damping", "servo.torque[].damping", &put_torque_servo},
      Place{"servo_integral", "servo.torque[].integral", &put_torque_servo},
      Place{"servo_dead_band", "servo.torque[].dead_band", &put_torque_servo},
      Place{"torque_limit", "servo.torque[].torque_limit", &put_torque_servo},
      Place{"torque_dead_band", "servo.torque[].torque_dead_band", &put_torque_servo},
      Place{"servo_voltage", "servo.torque[].stall_torque", &put_torque_servo},
      Place{"tool_servo", "servo.tool",
            [](const Cell& from, int, Cell& to) { to.servo->tool->natural_frequency = tool_servo(from); }},
      Place{"tool_damping", "servo.tool",
            [](const Cell& from, int, Cell& to) { to.servo->tool->damping_ratio = tool_damping(from); }},
      Place{"tool_delay", "servo.tool",
            [](const Cell& from, int, Cell& to) { to.servo->tool->delay = tool_delay(from); }},
      Place{"payload", "tool.mass, tool.com, tool.inertia", &put_payload},
      Place{"hand_eye", "camera.T_E_C", &put_camera_mount},
      Place{"laser_mount", "laser.T_E_L", &put_scanner_mount},
      Place{"tool_offset", "tool.T_F_E", &put_tool_offset},
      Place{"camera_focal", "camera.fx",
            [](const Cell& from, int, Cell& to) { to.camera->set_pinhole(camera_focal(from, to.camera->pinhole())); }},
      Place{
          "lens_distortion", "camera.distortion",
          [](const Cell& from, int, Cell& to) { to.camera->set_pinhole(lens_distortion(from, to.camera->pinhole())); }},
      Place{"contact_stiffness", "contact.stiffness",
            [](const Cell& from, int, Cell& to) { to.contact->stiffness = contact_stiffness(from); }},
      Place{"gripper_compliance", "contact.stiffness",
            [](const Cell& from, int, Cell& to) { to.contact->stiffness = EffectiveContact(from).stiffness(); },
            "axial"},
      Place{"contact_friction", "contact.friction",
            [](const Cell& from, int, Cell& to) { to.contact->friction = contact_friction(from); }},
      Place{"tube_radius", "tube.inner_radius",
            [](const Cell& from, int, Cell& to) { to.tube->inner_radius = tube_radius(from); }},
  };
}

/// All places, in an order in which one may build on another: mounts that are given from the nominal tip before the tip
/// moves, rows of the arm before the zeros of its joints. Every law of a link has its place there.
const std::vector<Place>& all_places() {
  static const std::vector<Place> places = [] {
    std::vector<Place> out = own_places();
    auto at = std::ranges::find(out, "encoder_offset", &Place::effect);  // behind the rows of the arm
    for (const LinkLaw& each : link_laws())
      at = std::next(
          out.insert(at, Place{each.effect, "robot.links[]", [law = each.law](const Cell& from, int i, Cell& to) {
                                 link_of(to, i) = law(from, i, link_of(to, i));
                               }}));
    return out;
  }();
  return places;
}

/// Why an effect that has a place in general has none in this cell; empty: it has.
std::string objection(const Place& place, const Cell& cell, const ActiveEffect& active) {
  if (place.field.starts_with("drives.")) return cell.drives ? "" : "the cell has no drives, in which it has its place";
  if (!cell::effect_possible(cell::find_effect(active.id), cell, active.target))
    return "the cell has nothing that it acts on";
  if (active.id == "encoder_offset" && slides(cell, active.index) && cell.effects.carries("thermal_growth"))
    return "its place is a length that grows with the arm, and the zero of a slide does not grow";
  return "";
}

std::string field_text(const Place& place, int index) {
  std::string out(place.field);
  if (const std::size_t at = out.find("[]"); at != std::string::npos) out.insert(at + 1, std::to_string(index));
  return out;
}

/// Puts the effects of a place that the cell carries into its parameters.
void fold(const Place& place, const Cell& from, FoldedCell& out) {
  for (ActiveEffect& active : cell::active_effects(from.effects)) {
    if (active.id != place.effect || !objection(place, from, active).empty()) continue;
    if (!place.parameter.empty())
      std::erase_if(active.parameters, [&](const auto& p) { return p.first != place.parameter; });
    if (active.parameters.empty()) continue;
    Cell changed = out.cell;
    place.put(from, active.index, changed);
    for (const auto& [name, value] : active.parameters)
      changed.effects.set(active.id, active.target, name, std::nullopt);
    if (!changed.valid()) continue;
    out.cell = std::move(changed);
    std::string field = field_text(place, active.index);
    out.folded.push_back({std::move(active), std::move(field)});
  }
}

/// Effects of an application whose law changes the cell, as a simulator applies them.
void apply_registered(FoldedCell& out) {
  std::vector<ActiveEffect> found;
  for (ActiveEffect& active : cell::active_effects(out.cell.effects)) {
    const cell::Effect& row = cell::find_effect(active.id);
    if (row.change_cell && !row.change_columns) found.push_back(std::move(active));
  }
  for (const ActiveEffect& active : found) out.cell.effects.remove(active.id);
  for (ActiveEffect& active : found) {
    cell::find_effect(active.id).change_cell(out.cell, active);
    out.folded.push_back({std::move(active), ""});
  }
}

std::string reason_of(const ActiveEffect& active, const Cell& cell) {
  const auto place = std::ranges::find(all_places(), active.id, &Place::effect);
  const bool known = place != all_places().end();
  if (known && place->parameter.empty()) {
    const std::string text = objection(*place, cell, active);
    return text.empty() ? "no cell may have this value" : text;
  }
  return "no nominal parameter of a cell describes it";
}

bool has_friction(const ActiveEffect& active) {
  return std::ranges::any_of(all_places(), [&](const Place& place) {
    return place.effect == active.id && place.field.starts_with("drives.friction.");
  });
}

}  // namespace

FoldedCell fold_effects(const Cell& cell, const FoldOptions& options) {
  FoldedCell out{cell, {}, {}};
  apply_registered(out);
  const std::vector<ActiveEffect> active = cell::active_effects(out.cell.effects);
  if (options.add_drives && !out.cell.drives && std::any_of(active.begin(), active.end(), has_friction))
    out.cell.drives = cell::unit_drives(cell.robot.joints());
  const Cell from = out.cell;
  for (const Place& place : all_places()) fold(place, from, out);
  for (ActiveEffect& left : cell::active_effects(out.cell.effects)) {
    const std::string reason = reason_of(left, out.cell);
    out.remaining.push_back({std::move(left), reason});
  }
  return out;
}

}  // namespace kr5::physics
