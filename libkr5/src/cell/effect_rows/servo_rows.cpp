// SPDX-License-Identifier: BSD-3-Clause
#include "cell/effect_rows.hpp"
#include "cell/effect_rows/row_parts.hpp"

namespace kr5::cell {

using namespace rows;

namespace {

/// The servo of a joint; one at rest for cells without.
TorqueServo servo_of(const EffectSite& at) {
  return at.cell.has_torque_servos() ? at.cell.servo->torque_of(at.index) : TorqueServo{};
}

/// Nominal value of a field; nothing for cells without torque servos.
auto nominal(double TorqueServo::*field) {
  return [field](const EffectSite& at) -> std::optional<EffectValue> {
    if (!at.cell.has_torque_servos()) return std::nullopt;
    return servo_of(at).*field;
  };
}

constexpr double usual_error = 5 * typical::angle;  // of a dead band [rad]
constexpr double usual_stiffness = 20.0;            // where none is stated [N m/rad]

double stiffness_of(const EffectSite& at) {
  const double stated = servo_of(at).stiffness;
  return stated > 0 ? stated : usual_stiffness;
}

}  // namespace

/// Effects of torque servos, which cells without them do not carry.
std::vector<Effect> servo_rows() {
  using Site = EffectSite;
  using enum EffectTarget;
  return {
      {.id = "servo_stiffness",
       .target = Joint,
       .label = "stiffness of the servo",
       .description = "stiffness of the torque servo differs",
       .shows_in = "measured position of its joint: droop under load, and how far it lags and overshoots",
       .remedy = "Put this stiffness into the model of the servo, or set its gain so.",
       .parameters = {{.name = "stiffness",
                       .unit = "N m/rad",
                       .lower = 1e-6,
                       .upper = 1e7,
                       .description = "torque over the error of the position",
                       .nominal = nominal(&TorqueServo::stiffness),
                       .size = [](const Site& at) { return typical::part * stiffness_of(at); }}},
       .needs = has_torque_servo},
      {.id = "servo_damping",
       .target = Joint,
       .label = "damping of the servo",
       .description = "damping of the torque servo differs",
       .shows_in = "measured position of its joint: lag in proportion to the speed",
       .remedy = "Put this damping into the model of the servo.",
       .parameters = {{.name = "damping",
                       .unit = "N m s/rad",
                       .upper = 1e6,
                       .description = "torque over the speed",
                       .nominal = nominal(&TorqueServo::damping),
                       .size =
                           [](const Site& at) {
                             const double stated = servo_of(at).damping;
                             constexpr double lag = 0.02;  // damping over stiffness where none is stated [s]
                             return typical::part * (stated > 0 ? stated : lag * stiffness_of(at));
                           }}},
       .needs = has_torque_servo},
      {.id = "servo_integral",
       .target = Joint,
       .label = "integral gain of the servo",
       .description = "integral gain of the torque servo differs",
       .shows_in = "measured position of its joint: droop that fades while it stands",
       .remedy = "Put this gain into the model of the servo, or switch the integral off.",
       .parameters = {{.name = "integral",
                       .unit = "N m/(rad s)",
                       .upper = 1e7,
                       .description = "torque over the integral of the error",
                       .nominal = nominal(&TorqueServo::integral),
                       .size = [](const Site& at) { return typical::part * stiffness_of(at); }}},
       .needs = has_torque_servo},
      {.id = "servo_dead_band",
       .target = Joint,
       .label = "dead band of the servo",
       .description = "the servo gives no torque for a small error",
       .shows_in = "measured position of its joint: it stops short of its command, on either side",
       .remedy = "Narrow the dead band in the servo's settings, or put it into the model.",
       .parameters = {{.name = "dead_band",
                       .unit = "rad",
                       .upper = 0.5,
                       .description = "greatest error without torque",
                       .nominal = nominal(&TorqueServo::dead_band),
                       .size = constant(usual_error),
                       .signature_at = at({0.5, 2.0}),
                       .step = 0.05}},
       .needs = has_torque_servo},
      {.id = "torque_limit",
       .target = Joint,
       .label = "torque limit of the servo",
       .description = "the servo gives no more torque than this",
       .shows_in = "measured position of its joint: it falls behind where much torque is asked for",
       .remedy = "Raise the limit in the servo's settings, use a stronger motor, or put the limit into the model.",
       .parameters = {{.name = "torque",
                       .unit = "N m",
                       .off = {inf},
                       .lower = 1e-6,
                       .upper = inf,
                       .description = "greatest torque, beside the limit that the cell states; infinite: no other",
                       .coordinate = CoordinateKind::Reciprocal,
                       .size =
                           [](const Site& at) {
                             constexpr double error = 0.05;  // from which such a servo often saturates [rad]
                             return 1.0 / (error * stiffness_of(at));
                           },
                       .signature_at = at({0.5, 1.0, 2.0, 4.0})}},
       .needs = has_torque_servo},
      {.id = "torque_dead_band",
       .target = Joint,
       .label = "dead band of the drive",
       .description = "the drive gives less torque than it is asked for, and none of a small one",
       .shows_in = "measured position of its joint: it stops short of its command, and droops further under load",
       .remedy = "Put the dead band into the model; a motor and gear that stick before they turn have one.",
       .parameters = {{.name = "torque",
                       .unit = "N m",
                       .upper = 1e5,
                       .description = "greatest torque that is asked and does not come out",
                       .nominal = nominal(&TorqueServo::torque_dead_band),
                       .size = [](const Site& at) { return usual_error * stiffness_of(at); },
                       .signature_at = at({0.5, 2.0}),
                       .step = 0.05}},
       .needs = has_torque_servo},
      {.id = "servo_voltage",
       .target = Joint,
       .label = "supply voltage of the servo",
       .description = "the supply voltage differs, and with it stall torque and no-load speed",
       .shows_in = "measured position of its joint: it falls behind in fast motions under load",
       .remedy = "Charge the battery, use a stronger supply or thicker wires, or put the limits into the model.",
       .parameters = {{.name = "voltage",
                       .unit = "-",
                       .off = {1.0},
                       .lower = 0.01,
                       .upper = 10,
                       .description =
                           "supply voltage over the nominal one, in proportion to which are stall torque and "
                           "no-load speed",
                       .coordinate = CoordinateKind::Ratio,
                       .size = constant(typical::part),
                       .signature_at = at({-7.0, -5.0, -3.0, -1.0})}},
       .needs = has_voltage_limit},
  };
}

}  // namespace kr5::cell
