// SPDX-License-Identifier: BSD-3-Clause
#include "cell/effect_rows.hpp"
#include "cell/effect_rows/row_parts.hpp"

namespace kr5::cell {

using namespace rows;

std::vector<Effect> drive_rows() {
  using Site = EffectSite;
  using enum EffectTarget;
  return {
      {.id = "coulomb_friction",
       .target = Joint,
       .label = "Coulomb friction",
       .description = "level of the dry friction differs",
       .shows_in = in_current + ": a step where the motion reverses, the same at any speed",
       .remedy = "Put the level into the cell. If it has risen, check brake, seals and grease.",
       .parameters = {{.name = "coulomb",
                       .unit = "N m",
                       .upper = 1e5,
                       .description = "level of the dry friction",
                       .nominal = [](const Site& at) -> std::optional<EffectValue> {
                         if (!at.cell.drives) return std::nullopt;
                         return at.cell.drives->friction.coulomb(at.index);
                       },
                       .size = [](const Site& at) { return typical::part * typical::friction(at); }}},
       .needs = has_links},
      {.id = "viscous_friction",
       .target = Joint,
       .label = "viscous friction",
       .description = "slope of the viscous friction differs",
       .shows_in = in_current + ": grows in proportion to the speed",
       .remedy = "Use this value as viscous friction; it changes with the temperature of the grease.",
       .parameters = {{.name = "viscous",
                       .unit = "N m s/rad",
                       .upper = 1e5,
                       .description = "slope of the friction over speed",
                       .nominal = [](const Site& at) -> std::optional<EffectValue> {
                         if (!at.cell.drives) return std::nullopt;
                         return at.cell.drives->friction.viscous(at.index);
                       },
                       .size = [](const Site& at) { return typical::part * typical::viscous(at); }}},
       .needs = has_links},
      {.id = "stribeck_friction",
       .target = Joint,
       .label = "Stribeck friction",
       .description = "extra friction at low speed, s exp(-(v/vs)^2)",
       .shows_in = in_current + ": extra effort at low speed, gone at high speed",
       .remedy = "Put it into the cell. Slow motions and reversals are affected most; check the lubrication.",
       .parameters = {{.name = "stribeck",
                       .unit = "N m",
                       .upper = 1e5,
                       .description = "s, added to the dry friction at standstill",
                       .size = [](const Site& at) { return typical::part * typical::friction(at); }},
                      {.name = "stribeck_velocity",
                       .unit = "rad/s",
                       .off = {0.1},
                       .lower = 1e-5,
                       .upper = 100,
                       .description = "vs, where it fades",
                       // Speeds at which friction is known to fade run over three decades.
                       .coordinate = CoordinateKind::Logarithmic,
                       .range =
                           [](const Site&) {
                             return ValueRange{3e-3, 2.0};
                           },
                       .signature_at = at({0.01, 0.03, 0.1, 0.3})}},
       .needs = has_links},
      {.id = "load_friction",
       .target = Joint,
       .label = "friction that grows with the load",
       .description = "friction that grows with the transmitted torque",
       .shows_in = in_current + ": larger where the gear carries more torque",
       .remedy = "Put the coefficient into the cell; it rises with the wear of the gear.",
       .parameters = {{.name = "coefficient",
                       .unit = "-",
                       .upper = 1,
                       .description = "friction over transmitted torque",
                       .size = constant(0.02)}},
       .needs = has_links},
      {.id = "thermal_friction",
       .target = Joint,
       .label = "friction that falls as the gear warms",
       .description = "friction falls as the gear warms",
       .shows_in = in_current + ": fades over the session, against the motion",
       .remedy = "Warm the robot up before recording, or keep the effect in the cell.",
       .parameters = {{.name = "drop",
                       .unit = "-",
                       .upper = 1,
                       .description = "part of the friction that is lost when warm",
                       .size = constant(typical::part)},
                      {.name = "time_constant",
                       .unit = "s",
                       .off = {600.0},
                       .lower = 1e-3,
                       .upper = 1e6,
                       .description = "of the warming",
                       .coordinate = CoordinateKind::Logarithmic,
                       .range = warming_range,
                       .signature_at = warming_times}},
       .needs = has_links},
      {.id = "joint_elasticity",
       .target = Joint,
       .label = "joint elasticity",
       .description = "spring between motor and link",
       .shows_in = "poses, views and scans by the sag under gravity; currents and wrench by vibration",
       .remedy = "Put the stiffness into the cell; the sag follows posture and payload.",
       .parameters = {{.name = "stiffness",
                       .unit = "N m/rad",
                       .off = {inf},
                       .lower = 1,
                       .upper = inf,
                       .description = "of the spring; infinite: rigid",
                       // Compliance is nearly linear, stiffness is not: a usual angle under three times the friction.
                       .coordinate = CoordinateKind::Reciprocal,
                       .size = [](const Site& at) { return typical::angle / (3 * typical::friction(at)); }}},
       .needs = has_soft_drives},
      {.id = "backlash",
       .target = Joint,
       .label = "backlash",
       .description = "free play between motor and link",
       .shows_in = "poses, views and scans where the load of the joint changes side; peaks of the wrench at reversals",
       .remedy = "Approach targets from one side; have the play of the gear measured.",
       .parameters = {{.name = "gap",
                       .unit = "rad",
                       .upper = 0.2,
                       .description = "full width of the play",
                       .size = constant(typical::angle),
                       .signature_at = at({0.5, 2.0}),
                       .step = 0.1}},
       .inaccuracy = 0.2,  // its blows last less than a row, and how hard they are hangs on their instant
       .needs = has_soft_drives},
      {.id = "torque_constant",
       .target = Joint,
       .label = "motor torque constant",
       .description = "current-to-torque scale differs",
       .shows_in = in_current + ": in proportion to the whole torque",
       .remedy = "Put the constant into the cell; check the scale of the logged current.",
       .parameters = {{.name = "torque_constant",
                       .unit = "N m/A",
                       .lower = 1e-6,
                       .upper = 1e4,
                       .description = "motor torque over current",
                       .nominal = [](const Site& at) { return at.cell.drives->torque_constant(at.index); },
                       .size =
                           [](const Site& at) { return typical::scale * at.cell.drives->torque_constant(at.index); },
                       .range =
                           [](const Site& at) {
                             return ValueRange{0.1 * at.cell.drives->torque_constant(at.index), 1e4};
                           }}},
       .needs = has_drives},
      {.id = "rotor_inertia",
       .target = Joint,
       .label = "rotor inertia",
       .description = "reflected rotor inertia differs",
       .shows_in = in_current + ": in proportion to its acceleration",
       .remedy = "Put the inertia into the cell.",
       .parameters = {{.name = "rotor_inertia",
                       .unit = "kg m^2",
                       .upper = 100,
                       .description = "motor side",
                       .nominal = [](const Site& at) { return at.cell.drives->rotor_inertia(at.index); },
                       .size = typical::rotor_inertia}},
       .needs = has_drives},
      {.id = "cable_spring",
       .target = Joint,
       .label = "pull of the dress pack",
       .description = "dress pack pulls like a spring",
       .shows_in = in_current + ": in proportion to the joint angle",
       .remedy = "Check the routing of hoses and cables; give them slack, or keep the spring in the cell.",
       .parameters = {{.name = "stiffness",
                       .unit = "N m/rad",
                       .upper = 1e5,
                       .description = "of the dress pack",
                       .size = [](const Site& at) { return typical::part * typical::friction(at); }},
                      {.name = "rest",
                       .unit = "rad",
                       .lower = -4 * turn,
                       .upper = 4 * turn,
                       .description = "joint angle without pull",
                       .coordinate = CoordinateKind::Quotient,
                       .size = constant(1.0),
                       .range = reach_of_joint,
                       .signature_at =
                           [](const Site& at) {
                             const ValueRange reach = reach_of_joint(at);
                             return std::vector<double>{reach.lower, reach.upper};
                           }}},
       .needs = has_drives},
      {.id = "torque_ripple",
       .target = Joint,
       .label = "torque ripple",
       .description = "torque periodic in joint angle, amplitude sin(cycles q + phase)",
       .shows_in = in_current + ": periodic in the joint angle",
       .remedy = "Put it into the cell; damage of a tooth or bearing makes it grow.",
       .parameters =
           periodic_parameters({.name = "amplitude",
                                .unit = "N m",
                                .lower = -1e4,
                                .upper = 1e4,
                                .description = "of the ripple",
                                .coordinate = CoordinateKind::Amplitude,
                                .size = [](const Site& at) { return typical::part * typical::friction(at); }}),
       .needs = has_drives},
      {.id = "wrist_coupling",
       .target = Motor,
       .label = "coupling between motors and joints",
       .description = "a coupling term of the structure matrix differs, between torque and current",
       .shows_in = "the current of its motor: follows the torque of another joint",
       .remedy = "Correct the structure matrix in the cell.",
       .parameters = {{.name = "element",
                       .kind = EffectValueKind::Whole,
                       .unit = "-",
                       .upper = 99,
                       .description = "column of the structure matrix",
                       .coordinate = CoordinateKind::Choice,
                       .choices =
                           [](const Site& at) {
                             std::vector<EffectChoice> out;
                             for (int i = 0; i < at.cell.robot.joints(); ++i)
                               if (i != at.index)  // that is a gear ratio, not a coupling
                                 out.push_back({i, "element " + std::to_string(i)});
                             return out;
                           },
                       .refers_to = Joint},
                      {.name = "value",
                       .unit = "-",
                       .lower = -1e4,
                       .upper = 1e4,
                       .description = "value of that element",
                       .nominal = [](const Site& at) { return at.cell.drives->structure(at.index, at.choice); },
                       .size =
                           [](const Site& at) {
                             const Eigen::MatrixXd& S = at.cell.drives->structure;
                             return 0.01 * std::sqrt(std::abs(S(at.index, at.index) * S(at.choice, at.choice)));
                           }}}},
  };
}

}  // namespace kr5::cell
