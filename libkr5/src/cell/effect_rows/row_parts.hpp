// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/cell/effect.hpp>
#include <kr5/robot/cycle.hpp>

/// @file
/// What several rows of the catalogue share: sizes that effects often have, conditions, and words.

namespace kr5::cell {

/// Orders of magnitude of industrial arms and of their data sheets: where finite differences are taken, and what a
/// prior calls plausible. Nothing depends on their digits.
namespace typical {

inline constexpr double angle = 1e-3;        ///< Zeros, twists, play, tilt [rad].
inline constexpr double length = 1e-3;       ///< Links and mounts [m].
inline constexpr double centre = 0.02;       ///< Centres of mass [m].
inline constexpr double part = 0.2;          ///< Relative change of a bandwidth, a friction, a stiffness.
inline constexpr double scale = 0.05;        ///< Relative error of a factor from a data sheet (gain, torque constant).
inline constexpr double backwards = 0.1;     ///< Efficiency that a gear lacks when its load drives it.
inline constexpr double half_cycle = 0.006;  ///< Delays and lags [s].
inline constexpr double reflected_inertia = 0.05;  ///< Of a rotor, joint side, of which none is known [kg m^2 or kg].
inline constexpr double load_inertia = 0.01;       ///< 1 kg at 0.1 m from its centre [kg m^2].
inline constexpr double coulomb = 5.0;             ///< Dry friction of a joint of which none is known [N m or N].
inline constexpr double force_noise = 0.1;         ///< Of a wrist sensor of which none is known [N].
inline constexpr double torque_noise = 0.01;       ///< The same [N m].

/// Dry friction of a joint, the measure of all torques that disturb it [N m or N].
inline double friction(const EffectSite& at) {
  if (at.cell.drives && at.cell.drives->friction.coulomb(at.index) > 0)
    return at.cell.drives->friction.coulomb(at.index);
  return coulomb;
}

inline double viscous(const EffectSite& at) {
  if (at.cell.drives && at.cell.drives->friction.viscous(at.index) > 0)
    return at.cell.drives->friction.viscous(at.index);
  return friction(at);
}

/// Motor side; where none is stated that of a small joint [kg m^2 or kg].
inline double rotor_inertia(const EffectSite& at) {
  if (const double stated = at.cell.drives->rotor_inertia(at.index); stated > 0) return part * stated;
  const double gear = at.cell.drives->structure(at.index, at.index);
  return reflected_inertia / std::max(gear * gear, 1.0);
}

/// Noise of a component of the wrench, or a usual one [N, N m].
inline double wrench_noise(const Cell& cell, int component) {
  if (component < 3) return cell.noise.force > 0 ? cell.noise.force : force_noise;
  return cell.noise.torque > 0 ? cell.noise.torque : torque_noise;
}

}  // namespace typical

namespace rows {

inline constexpr double inf = std::numeric_limits<double>::infinity();
inline constexpr double turn = 2 * std::numbers::pi;

inline auto constant(double value) {
  return [value](const EffectSite&) { return value; };
}

inline auto at(std::vector<double> values) {
  return [values = std::move(values)](const EffectSite&) { return values; };
}

/// Time constants between a hundredth of the recording and thirty times it.
/// Metal takes longer: what fades within a few seconds is no warming, but a value that differs from the beginning.
inline constexpr double fastest_warming = 5.0;  // [s]
inline ValueRange warming_range(const EffectSite& at) {
  const double least = std::max(at.duration() / 100, fastest_warming);
  return {least, std::max(30 * at.duration(), 6 * least)};
}
/// Time constants at which what fades is told apart.
inline std::vector<double> warming_times(const EffectSite& at) {
  const double length = std::max(at.duration(), 10 * fastest_warming);
  return {0.1 * length, 0.5 * length, 3.0 * length};
}

/// Where a dress pack rests: within reach of the joint. One that rests far away would be a constant torque.
inline ValueRange reach_of_joint(const EffectSite& at) {
  constexpr double beyond = 0.5, unlimited = 6.3;  // [rad]
  const auto& limits = at.cell.robot.limits;
  if (!limits) return {-unlimited, unlimited};
  return {limits->lower(at.index) - beyond, limits->upper(at.index) + beyond};
}

/// amplitude sin(cycles q + phase)
inline std::vector<EffectParameter> periodic_parameters(EffectParameter amplitude) {
  return {std::move(amplitude),
          {.name = "cycles",
           .kind = EffectValueKind::Whole,
           .unit = "-",
           .off = {1.0},
           .lower = 1,
           .upper = 1e4,
           .description = "periods a turn of the joint",
           .coordinate = CoordinateKind::Cycles},
          {.name = "phase",
           .unit = "rad",
           .lower = -turn,
           .upper = turn,
           .required = false,
           .description = "at joint angle 0",
           .coordinate = CoordinateKind::Phase}};
}

inline const EffectNeed has_drives{"drives", [](const Cell& cell) { return cell.drives.has_value(); }};
inline const EffectNeed has_links{"link masses (robot.links)",
                                  [](const Cell& cell) { return !cell.robot.links.empty(); }};
inline const EffectNeed has_servo{"servo", [](const Cell& cell) { return cell.servo.has_value(); }};
/// The joints of a cell have one kind of servo, in the place of the other.
inline bool joints_follow(const Cell& cell) { return cell.servo && !cell.servo->joint.empty(); }
inline bool joints_are_driven(const Cell& cell) { return cell.has_torque_servos(); }
inline const EffectNeed has_joint_servo{"joint servo (servo.joint)", joints_follow, joints_are_driven};
inline const EffectNeed has_torque_servo{"torque servo (servo.torque)", joints_are_driven, joints_follow};
inline const EffectNeed has_voltage_limit{"limit by the supply voltage (servo.torque: stall_torque, no_load_speed)",
                                          [](const Cell& cell) {
                                            return joints_are_driven(cell) &&
                                                   std::ranges::any_of(cell.servo->torque, [](const TorqueServo& one) {
                                                     return one.stall_torque && one.no_load_speed;
                                                   });
                                          },
                                          joints_follow};
inline const EffectNeed follows_commands{"servo of the joints (servo.joint, servo.torque)", [](const Cell& cell) {
                                           return joints_are_driven(cell) || joints_follow(cell);
                                         }};
/// A torque servo is simulated on a rigid gear.
inline const EffectNeed has_soft_drives{"drives behind joint servos (drives, servo.joint)", [](const Cell& cell) {
                                          return cell.drives.has_value() && !cell.has_torque_servos();
                                        }};
inline const EffectNeed has_tool_servo{"servo of the path correction (servo.tool)",
                                       [](const Cell& cell) { return cell.servo && cell.servo->tool; }};
inline const EffectNeed has_contact{"contact", [](const Cell& cell) { return cell.contact.has_value(); }};

inline const std::string in_current = "the current of its joint";
inline const std::string in_loads =
    "currents or torques of its joint and of the joints before it: by weight and inertia of the link, depending on the "
    "posture";
inline const std::string in_pose = "everything that depends on where the tool is: poses, views, scans";
inline const std::string in_wrench = "this component of the wrench, in every experiment that records it";
inline const std::string in_path = "z of step and press";
inline const std::string in_profile = "z and the wrench of profiles";

}  // namespace rows

}  // namespace kr5::cell
