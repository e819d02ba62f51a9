// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "cell/effect_rows.hpp"
#include "cell/effect_rows/row_parts.hpp"

namespace kr5::cell {

using namespace rows;

namespace {

double usual_compliance(const EffectSite& at) { return typical::part / at.cell.contact->stiffness; }

}  // namespace

std::vector<Effect> task_rows() {
  using Site = EffectSite;
  using enum EffectTarget;
  return {
      {.id = "contact_stiffness",
       .target = Contact,
       .label = "contact stiffness",
       .description = "stiffness of the contact differs",
       .shows_in = "fz of press, z of profiles",
       .remedy = "Put the stiffness into the cell; it is the total of bench, tool and arm.",
       .parameters = {{.name = "stiffness",
                       .unit = "N/m",
                       .lower = 1,
                       .upper = 1e9,
                       .description = "total of all compliance in series",
                       .coordinate = CoordinateKind::Ratio,
                       .nominal = [](const Site& at) { return at.cell.contact->stiffness; },
                       .size = constant(typical::part)}}},
      {.id = "contact_hardening",
       .target = Contact,
       .label = "hardening contact",
       .description = "stiffness grows with depth, k p (1 + h p / 1 mm)",
       .shows_in = "fz of press, z of profiles: increasing with depth",
       .remedy = "Put it into the cell; pads and seats harden under load.",
       .parameters = {{.name = "hardening",
                       .unit = "1/mm",
                       .lower = -10,
                       .upper = 100,
                       .description = "h, per mm of depth",
                       .size = constant(typical::part)}}},
      {.id = "contact_friction",
       .target = Contact,
       .label = "contact friction",
       .description = "friction of peg on tube differs",
       .shows_in = "the wrench of profiles, across the peg",
       .remedy = "Clean peg and tube, or put the coefficient into the cell.",
       .parameters = {{.name = "friction",
                       .unit = "-",
                       .upper = 5,
                       .description = "coefficient",
                       .nominal = [](const Site& at) { return at.cell.contact->friction; },
                       .size =
                           [](const Site& at) { return typical::part * std::max(at.cell.contact->friction, 0.1); }}}},
      {.id = "gripper_compliance",
       .target = Gripper,
       .label = "compliance of the grip",
       .description = "the grip yields under load",
       .shows_in = "fz of press, z and the wrench of profiles",
       .remedy = "Check jaws and springs of the gripper.",
       .parameters = {{.name = "lateral",
                       .unit = "m/N",
                       .upper = 1e-2,
                       .required = false,
                       .description = "across the peg",
                       .size = usual_compliance},
                      {.name = "axial",
                       .unit = "m/N",
                       .upper = 1e-2,
                       .required = false,
                       .description = "along the peg, in series with the contact",
                       .size = usual_compliance}}},
      {.id = "tube_tilt",
       .target = Tube,
       .label = "tilt of the tube",
       .description = "the tube is tilted",
       .shows_in = in_profile + ": once a turn",
       .remedy = "Align the tube in its holder, or set its tilt in the cell.",
       .parameters = {{.name = "tilt",
                       .kind = EffectValueKind::Vector2,
                       .unit = "rad",
                       .lower = -0.8,
                       .upper = 0.8,
                       .description = "about X then Y of T",
                       .size = constant(10 * typical::angle)}},
       .needs = has_contact},
      {.id = "tube_shift",
       .target = Tube,
       .label = "position of the tube",
       .description = "position of the tube differs",
       .shows_in = in_profile,
       .remedy = "Measure the position of the tube, and set it in the cell.",
       .parameters = {{.name = "shift",
                       .kind = EffectValueKind::Vector3,
                       .unit = "m",
                       .lower = -1,
                       .upper = 1,
                       .description = "along X Y (Z) of T",
                       .size = constant(0.3 * typical::length)}},
       .needs = has_contact},
      {.id = "tube_radius",
       .target = Tube,
       .label = "bore of the tube",
       .description = "radius of the bore differs",
       .shows_in = in_profile,
       .remedy = "Measure the bore; this may be a different tube.",
       .parameters = {{.name = "inner_radius",
                       .unit = "m",
                       .lower = 1e-5,
                       .upper = 1,
                       .description = "radius of the bore",
                       .nominal = [](const Site& at) { return at.cell.tube->inner_radius; },
                       .size = [](const Site& at) { return 0.01 * at.cell.tube->inner_radius; },
                       .range =
                           [](const Site& at) {
                             return ValueRange{0.1 * at.cell.tube->inner_radius, 1.0};
                           }}},
       .needs = has_contact},
  };
}

}  // namespace kr5::cell
