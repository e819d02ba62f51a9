// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include <kr5/cell/cell.hpp>

/// @file
/// The law of a torque servo (cell::TorqueServo) and its effects.

namespace kr5::physics {

/// How late a torque servo gets its command [s]. Needs torque servos.
double torque_servo_delay(const cell::Cell& cell, int joint);
/// Stiffness of the torque servo of a joint [N m/rad or N/m]. Needs torque servos, as the four below.
double servo_stiffness(const cell::Cell& cell, int joint);
/// Its damping [N m s/rad or N s/m].
double servo_damping(const cell::Cell& cell, int joint);
/// Its integral gain [N m/(rad s) or N/(m s)].
double servo_integral(const cell::Cell& cell, int joint);
/// Its dead band [rad or m].
double servo_dead_band(const cell::Cell& cell, int joint);
/// Its greatest torque, the lower of those of cell and effect; nothing without a limit [N m or N].
std::optional<double> torque_limit(const cell::Cell& cell, int joint);
/// Its dead band in torque [N m or N].
double torque_dead_band(const cell::Cell& cell, int joint);
/// Its supply voltage over the nominal one [-]: stall torque and no-load speed are in proportion to it.
double servo_voltage(const cell::Cell& cell, int joint);
/// The torque servo of a joint with the effects that the cell carries. Needs torque servos.
cell::TorqueServo torque_servo(const cell::Cell& cell, int joint);
/// One a joint; none when the cell has no torque servos.
std::vector<cell::TorqueServo> torque_servos(const cell::Cell& cell);

/// Ids of the effects by which a motion of torque servos differs from its commands in every arm: stiffness, damping,
/// dry friction, delay of the commands, inertia of the rotors.
const std::vector<std::string>& servo_motion_effects();
/// Ids of laws that act beside them in some servos: what the load of the gear, the square of the speed and an error of
/// the position within a band do.
const std::vector<std::string>& further_servo_effects();
/// Id of the friction that is told apart from the damping of a servo only while its motor is off.
const std::string& coasting_effect();

/// What of a value lies beyond a band to both sides of 0.
inline double beyond(double value, double band) { return value - std::clamp(value, -band, band); }

/// Part of an error of the position that makes a torque [rad or m].
inline double effective_error(const cell::TorqueServo& servo, double error) { return beyond(error, servo.dead_band); }

/// Torque that comes out of a drive of which this is asked, which gives nothing for one within its dead band [N m or
/// N].
inline double effective_torque(const cell::TorqueServo& servo, double asked) {
  return beyond(asked, servo.torque_dead_band);
}

/// Torques that a servo can give at a speed: each bound is `at_rest` less `slope` times the speed [N m or N],
/// [N m s/rad or N s/m]. Infinite without a limit.
struct TorqueBound {
  double at_rest = 0.0;
  double slope = 0.0;

  double at(double speed) const { return at_rest - slope * speed; }
};
/// The bound on one side (1 or -1) that holds at a speed: that of torque or that of the supply voltage.
TorqueBound torque_bound(const cell::TorqueServo& servo, double side, double speed);

/// Torque of a servo [N m or N]. @param error Delayed command less position [rad or m]. @param integral Of the
/// effective error over time. @param command_speed Of the delayed command. @param speed Of the joint.
double servo_torque(const cell::TorqueServo& servo, double error, double integral, double command_speed, double speed);

}  // namespace kr5::physics
