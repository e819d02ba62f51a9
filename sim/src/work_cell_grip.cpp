// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <utility>

#include <kr5/core/error.hpp>

#include "work_cell_world.hpp"

namespace kr5::sim {
namespace {

using Eigen::Vector3d;

constexpr double finger_inertia = 1e-4;   // of the moving fingers or cup with a pellet [kg m^2]
constexpr double rolling_settling = 6.0;  // damping of a pellet that rolls or rocks, as in a pile [1/s]
constexpr double near_margin = 1e-3;      // at which a carried pellet may touch something [m]
constexpr double pile_margin = 1e-3;      // of a pellet that has left the pile [m]
constexpr double clear_time = 0.1;        // after which a pellet in the grip has stopped swinging [s]

}  // namespace

/// Velocity of the tool's point there [m/s, rad/s].
Vector6 WorkCell::World::twist_at(const Vector3d& point) const {
  Vector6 out = now.velocity;
  out.head<3>() += now.velocity.tail<3>().cross(point - now.T_base_tool.translation());
  return out;
}

void WorkCell::World::touch_at(const Vector6& wrench, const Vector3d& point) {
  Vector6 out = wrench;
  out.tail<3>() += (point - arm.T_base_sensor().translation()).cross(wrench.head<3>());
  arm.touch(out);
}

Pose WorkCell::World::T_held_peg(const Pose& T_base_tool) const {
  return T_base_tool * now.gripper.T_tool_pellet * now.gripper.T_pellet_peg;
}

std::unique_ptr<HeldPeg> WorkCell::World::peg_of(int number, const Pose& T_pellet_peg, const Pose& T_tool_pellet,
                                                 double height) const {
  const PelletTruth& p = pellet(number);
  const double stiffness = real.contact->stiffness;
  Grip grip;
  grip.lateral = grip_factor * (options.lateral_stiffness > 0 ? options.lateral_stiffness : stiffness);
  grip.angular = grip_factor * options.angular_stiffness;
  grip.height = height;
  grip.air = options.air;
  grip.gravity = real.robot.gravity;
  grip.carried = true;
  grip.inertia = finger_inertia;
  grip.settling = rolling_settling;
  grip.force = grip_options().force;
  grip.torque = grip_options().torque;
  // The stem of the cup stands behind a pellet; between fingers nothing does.
  if (!now.gripper.told.fingers) grip.support = (T_tool_pellet * T_pellet_peg).linear().transpose().col(2);
  return std::make_unique<HeldPeg>(real,
                                   PegBody{.radius = p.radius, .length = p.height, .density = options.pile.density},
                                   grip, std::make_unique<PelletSurroundings>(solids, number, p.radius, p.height));
}

void WorkCell::World::tell_gripper(const robot::GripperCommand& command) {
  GripperState& g = now.gripper;
  const bool keeps = command.hold && g.pellet >= 0;  // whichever gripper is meant: the one that holds stays closed
  if (!keeps && (command.hold != g.told.hold || command.fingers != g.told.fingers)) {
    if (g.pellet >= 0) let_go();
    g.since = arm.time();
    g.spent = false;
    g.told = command;
  }
  g.told.air = command.air;
}

/// The nearest pellet that a gripper takes which closes now; a cup goes on sucking, fingers close once.
void WorkCell::World::close_gripper() {
  GripperState& g = now.gripper;
  const GripOptions& by = grip_options();
  if (!g.told.hold || g.pellet >= 0 || g.spent || arm.time() < g.since + by.closing) return;
  int best = -1;
  PelletTaken taken;
  const Pose T_tool_base = now.T_base_tool.inverse();
  for (int i = 0; i < static_cast<int>(now.pellets.size()); ++i) {
    const PelletTruth& p = pellet(i);
    const Pose T_tool_pellet = T_tool_base * p.T_base_pellet;
    const auto found = g.told.fingers ? taken_by_fingers(T_tool_pellet, p.radius, p.height, by, options.finger_length)
                                      : taken_by_cup(T_tool_pellet, p.radius, p.height, by);
    if (!found || (best >= 0 && found->distance >= taken.distance)) continue;
    best = i;
    taken = *found;
  }
  if (best >= 0)
    take(best, taken, by);
  else
    g.spent = g.told.fingers;
}

/// The pose at which a pellet overlaps with nothing, nearest to the one given.
Pose WorkCell::World::freed(int number, const Pose& T_base_pellet) const {
  constexpr int most = 20;
  Pose out = T_base_pellet;
  for (int k = 0; k < most; ++k) {
    const force::Contacts touching =
        solids.contacts(cylinder_of(out, pellet(number).radius, pellet(number).height), number);
    if (touching.count == 0) break;
    const auto& deepest = *std::max_element(touching.begin(), touching.end(),
                                            [](const auto& a, const auto& b) { return a.depth < b.depth; });
    out.translation() += deepest.depth * deepest.normal;
  }
  return out;
}

void WorkCell::World::take(int number, const PelletTaken& taken, const GripOptions& by) {
  GripperState& g = now.gripper;
  PelletTruth& p = pellet(number);
  Vector6 off = Vector6::Zero();
  if (options.noise)
    for (int i = 0; i < 6; ++i) off[i] = random.normal(i < 3 ? by.position : by.rotation);
  const Pose T_tool_base = now.T_base_tool.inverse();
  g.pellet = number;
  g.in_pile = p.place == PelletPlace::Bin;
  g.rigid = false;
  g.clear = g.slipped = g.force = 0.0;
  const bool was_loose = p.place == PelletPlace::Loose;
  p.place = PelletPlace::Grip;
  if (g.in_pile) {
    g.T_tool_pellet = T_tool_base * p.T_base_pellet;
    g.shift = g.T_tool_pellet.inverse() * taken.T_tool_pellet * to_pose(off);
    now.disturbed = pile.time();
    pile.wake_neighbours(body_in_pile(number), 1e-4);
    return;
  }
  if (was_loose) {
    const auto at = std::find_if(now.loose.begin(), now.loose.end(), [&](const auto& l) { return l.number == number; });
    loose.erase(loose.begin() + (at - now.loose.begin()));
    now.loose.erase(at);
  }
  note_resting();
  p.T_base_pellet = freed(number, now.T_base_tool * taken.T_tool_pellet * to_pose(off));
  g.T_tool_pellet = T_tool_base * p.T_base_pellet;
  g.T_pellet_peg = sim::T_pellet_peg(g.T_tool_pellet, p.height);
  g.height = std::clamp((g.T_tool_pellet * g.T_pellet_peg).inverse().translation().z(), 0.0, p.height);
  peg = peg_of(number, g.T_pellet_peg, g.T_tool_pellet, g.height);
  peg->place(T_held_peg(now.T_base_tool), twist_at(T_held_peg(now.T_base_tool).translation()));
}

/// The gripper drives the pellet for the next step of the pile.
void WorkCell::World::hold_in_pile() {
  const Eigen::Matrix3d R_bin_base = solids.bin.T_base_bin.linear().transpose();
  const Vector3d centre = pellet(now.gripper.pellet).T_base_pellet.translation();
  pile.hold(body_in_pile(now.gripper.pellet), R_bin_base * twist_at(centre).head<3>(), grip_options().force,
            grip_options().torque);
}

/// Whether the pellet has left the pile, or the gripper lost it there.
void WorkCell::World::watch_in_pile() {
  GripperState& g = now.gripper;
  const Eigen::Matrix3d& R = solids.bin.T_base_bin.linear();
  const Vector6 grip = pile.grip_wrench();
  Vector6 on_tool;
  on_tool << -(R * grip.head<3>()), -(R * grip.tail<3>());
  const Vector3d centre = pellet(g.pellet).T_base_pellet.translation();
  touch_at(on_tool, centre);
  g.force = std::max(g.force, grip.head<3>().norm());
  const double lag = (centre - now.T_base_tool * g.T_tool_pellet.translation()).norm();
  if (lag > grip_options().slip) {
    let_go();
    g.spent = true;
  } else if (pile.alone(body_in_pile(g.pellet), pile_margin)) {
    g.slipped = lag;
    take_out_of_pile();
  }
}

void WorkCell::World::take_out_of_pile() {
  GripperState& g = now.gripper;
  const int at = body_in_pile(g.pellet);
  PelletTruth& p = pellet(g.pellet);
  pile.release();
  pile.remove(at);
  now.pile_numbers.erase(now.pile_numbers.begin() + at);
  now.disturbed = pile.time();
  g.in_pile = false;
  g.rigid = true;
  note_resting();
  p.T_base_pellet = freed(g.pellet, p.T_base_pellet * g.shift);
  g.T_tool_pellet = now.T_base_tool.inverse() * p.T_base_pellet;
  g.T_pellet_peg = sim::T_pellet_peg(g.T_tool_pellet, p.height);
  g.height = std::clamp((g.T_tool_pellet * g.T_pellet_peg).inverse().translation().z(), 0.0, p.height);
  peg = peg_of(g.pellet, g.T_pellet_peg, g.T_tool_pellet, g.height);
}

/// Far from everything the pellet moves with the tool, which feels its weight and inertia.
void WorkCell::World::carry(const Pose& from, const Vector6& before, double passed) {
  GripperState& g = now.gripper;
  PelletTruth& p = pellet(g.pellet);
  const Pose T_base_pellet = now.T_base_tool * g.T_tool_pellet;
  const double way = (T_base_pellet.translation() - p.T_base_pellet.translation()).norm();
  if (solids.near(cylinder_of(T_base_pellet, p.radius, p.height), g.pellet, near_margin + way)) {
    g.rigid = false;
    g.clear = 0.0;
    const Pose T = T_held_peg(from);
    peg->place(T, twist_at(T.translation()));
    press(from, passed);
    return;
  }
  p.T_base_pellet = T_base_pellet;
  const Vector3d arm_to = T_base_pellet.translation() - now.T_base_tool.translation();
  const Vector6 change = (now.velocity - before) / passed;
  const Vector3d& turn = now.velocity.tail<3>();
  const Vector3d acceleration = change.head<3>() + change.tail<3>().cross(arm_to) + turn.cross(turn.cross(arm_to));
  Vector6 load = Vector6::Zero();
  load.head<3>() = peg->mass() * (real.robot.gravity - acceleration);
  touch_at(load, T_base_pellet.translation());
}

/// Near something the pellet moves on its own, between the springs of the grip and what it touches.
void WorkCell::World::press(const Pose& from, double passed) {
  GripperState& g = now.gripper;
  PelletTruth& p = pellet(g.pellet);
  const Pose begin = T_held_peg(from), end = T_held_peg(now.T_base_tool);
  Vector6 velocity;
  velocity << end.translation() - begin.translation(), log_rotation(end.linear() * begin.linear().transpose());
  velocity /= passed;
  const int steps = static_cast<int>(std::ceil(passed / peg->longest_step() - 1e-6));
  const double step = passed / steps;
  const Eigen::Matrix3d turn = exp_rotation(velocity.tail<3>() * step);
  Pose at = begin;
  peg->search_anew();
  for (int i = 0; i < steps; ++i) {
    at.translation() += step * velocity.head<3>();
    at.linear() = turn * at.linear();
    peg->advance(at, velocity, step);
  }
  touch_at(peg->on_grip(), at.translation());
  g.force = std::max(g.force, peg->max_force());
  p.T_base_pellet = peg->pose() * g.T_pellet_peg.inverse();
  g.clear = solids.near(body(g.pellet), g.pellet, 2 * near_margin) ? 0.0 : g.clear + passed;
  lose_if_slipped();
}

void WorkCell::World::lose_if_slipped() {
  GripperState& g = now.gripper;
  if (g.slipped + peg->slipped() > grip_options().slip) {
    let_go();
    g.spent = true;
  } else if (g.clear > clear_time) {
    g.slipped += peg->slipped();
    g.T_tool_pellet = g.T_tool_pellet * g.T_pellet_peg * peg->slip() * g.T_pellet_peg.inverse();
    g.rigid = true;
  }
}

void WorkCell::World::let_go() {
  GripperState& g = now.gripper;
  const int number = std::exchange(g.pellet, -1);
  if (std::exchange(g.in_pile, false)) {
    pile.release();
    pellet(number).place = PelletPlace::Bin;
    now.disturbed = pile.time();
    return;
  }
  if (g.rigid) {
    const Pose T = T_held_peg(now.T_base_tool);
    peg->place(T, twist_at(T.translation()));
  }
  peg->let_go();
  pellet(number).place = PelletPlace::Loose;
  now.loose.push_back({.number = number, .T_pellet_peg = g.T_pellet_peg, .T_base_quiet = pellet(number).T_base_pellet});
  loose.push_back(std::move(peg));
}

}  // namespace kr5::sim
