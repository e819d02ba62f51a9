// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/io/reader.hpp>

namespace kr5::cell {

/// Friction on the joint side: coulomb * tanh(qd / 0.002) + viscous * qd.
struct Friction {
  Eigen::VectorXd coulomb;  ///< [N m or N]
  Eigen::VectorXd viscous;  ///< [N m s/rad or N s/m]

  static constexpr std::array<std::string_view, 2> required = {"coulomb", "viscous"};
  static void each_field(auto& self, auto&& visit) {
    visit("coulomb", self.coulomb, "Coulomb friction of each joint [N m or N].");
    visit("viscous", self.viscous, "Viscous friction of each joint over its speed [N m s/rad or N s/m].");
  }
};

/// Motors and gears of n joints.
struct Drives {
  Eigen::MatrixXd structure;        ///< S, n x n: motor angle phi = S q, joint torque = S^T motor torque [-].
  Eigen::VectorXd rotor_inertia;    ///< Motor side [kg m^2].
  Eigen::VectorXd torque_constant;  ///< Motor side [N m/A].
  Friction friction;

  static constexpr std::array<std::string_view, 4> required = {"structure", "rotor_inertia", "torque_constant",
                                                               "friction"};
  static void each_field(auto& self, auto&& visit) {
    visit("structure", self.structure,
          "Structure matrix S, n x n: motor angle = S q; joint torque = S^T motor torque [-].");
    visit("rotor_inertia", self.rotor_inertia, "Inertia of each rotor, motor side [kg m^2].");
    visit("torque_constant", self.torque_constant, "Torque constant of each motor, motor side [N m/A].");
    visit("friction", self.friction, "Joint friction.");
  }
};

/// Drives of unit gear and unit torque constant, without rotor inertia and friction: a current is a joint torque.
Drives unit_drives(int joints);

/// x'' = wn^2 (u - x) - 2 xi wn x', with u the command `delay` earlier.
struct SecondOrder {
  double natural_frequency = 0.0;  ///< [rad/s]
  double damping_ratio = 0.0;      ///< [-]
  double delay = 0.0;              ///< [s]

  static constexpr std::array<std::string_view, 3> required = {"natural_frequency", "damping_ratio", "delay"};
  static void each_field(auto& self, auto&& visit) {
    visit("natural_frequency", self.natural_frequency, "Natural frequency wn [rad/s].");
    visit("damping_ratio", self.damping_ratio, "Damping ratio xi [-].");
    visit("delay", self.delay, "Delay from the command to its effect [s].");
  }
};

/// How a command runs from one step to the next.
enum class CommandHold {
  ZeroOrderHold,   ///< The command of a step holds over the whole of it.
  FirstOrderHold,  ///< It runs straight from that of the step before.
};
constexpr auto enum_names(CommandHold) {
  return names<CommandHold>({{CommandHold::ZeroOrderHold, "held"}, {CommandHold::FirstOrderHold, "straight"}});
}

/// Servo that turns the error of a joint into a torque, as hobby and research servos and the actuators of simulators
/// do: torque = stiffness e + integral (integral of e) + feed_forward du/dt - damping qd, with e the command `delay`
/// earlier less the position, outside the dead band. The drive gives less by its dead band in torque. The torque is
/// limited, and by the supply voltage the more the faster the joint turns: from -stall_torque (1 + qd / no_load_speed)
/// to stall_torque (1 - qd / no_load_speed).
struct TorqueServo {
  double stiffness = 0.0;               ///< [N m/rad or N/m]
  double damping = 0.0;                 ///< [N m s/rad or N s/m]
  double integral = 0.0;                ///< [N m/(rad s) or N/(m s)]
  double feed_forward = 0.0;            ///< On the speed of the command [N m s/rad or N s/m].
  double dead_band = 0.0;               ///< Greatest error without torque [rad or m].
  std::optional<double> torque_limit;   ///< [N m or N]
  std::optional<double> stall_torque;   ///< At full supply voltage [N m or N].
  std::optional<double> no_load_speed;  ///< At full supply voltage [rad/s or m/s].
  double torque_dead_band = 0.0;        ///< Greatest torque that is asked and does not come out [N m or N].
  double delay = 0.0;                   ///< [s]
  CommandHold hold = CommandHold::ZeroOrderHold;

  static constexpr std::array<std::string_view, 2> required = {"stiffness", "damping"};
  static void each_field(auto& self, auto&& visit) {
    visit("stiffness", self.stiffness, "Torque over the error of the position [N m/rad or N/m].");
    visit("damping", self.damping, "Torque over the speed, against it [N m s/rad or N s/m].");
    visit("integral", self.integral, "Torque over the integral of the error [N m/(rad s) or N/(m s)].");
    visit("feed_forward", self.feed_forward, "Torque over the speed of the command [N m s/rad or N s/m].");
    visit("dead_band", self.dead_band, "Greatest error of the position without torque [rad or m].");
    visit("torque_limit", self.torque_limit, "Maximum torque; absent: without limit [N m or N].");
    visit("stall_torque", self.stall_torque, "Torque at standstill under full supply voltage [N m or N].");
    visit("no_load_speed", self.no_load_speed, "Speed without torque under full supply voltage [rad/s or m/s].");
    visit("torque_dead_band", self.torque_dead_band,
          "Greatest torque that is asked and does not come out; a greater one is less by it [N m or N].");
    visit("delay", self.delay, "Delay from the command to its effect [s].");
    visit("hold", self.hold, "Command between its stamps: held | straight.");
  }
};

/// What a path correction is counted from.
enum class CorrectionMode {
  Absolute,  ///< The start of the path: the whole correction is given anew each cycle.
  Relative,  ///< Where the arm is: corrections add up.
};
constexpr auto enum_names(CorrectionMode) {
  return names<CorrectionMode>({{CorrectionMode::Absolute, "absolute"}, {CorrectionMode::Relative, "relative"}});
}

/// How a controller takes path corrections.
struct Correction {
  CorrectionMode mode = CorrectionMode::Absolute;
  std::optional<double> per_cycle;  ///< [m]
  std::optional<double> total;      ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("mode", self.mode,
          "Reference of corrections: absolute (the start of the path) | relative (the present pose).");
    visit("per_cycle", self.per_cycle,
          "Maximum change of an absolute correction, or maximum relative one, in one cycle [m].");
    visit("total", self.total, "Maximum distance of the commanded path from its start [m].");
  }
};

/// How commands become motion.
struct Servo {
  double cycle = 0.0;               ///< [s]
  std::vector<SecondOrder> joint;   ///< One for all joints, or one a joint.
  std::vector<TorqueServo> torque;  ///< In place of `joint`: one for all joints, or one a joint.
  std::optional<SecondOrder> tool;  ///< Path correction.
  std::optional<Correction> correction;

  /// The servo of joint `index` (from 0).
  const SecondOrder& of_joint(int index) const {
    return joint.at(joint.size() == 1 ? 0 : static_cast<std::size_t>(index));
  }

  /// The torque servo of joint `index` (from 0).
  const TorqueServo& torque_of(int index) const {
    return torque.at(torque.size() == 1 ? 0 : static_cast<std::size_t>(index));
  }

  /// In a file `joint` and `torque` are one map for all joints, a list of maps, or a map whose values are lists.
  bool from_node(io::Reader& reader, const io::Node& node, const std::string& field);
  io::Node to_node() const;

  static constexpr std::array<std::string_view, 1> required = {"cycle"};
  static void each_field(auto& self, auto&& visit) {
    visit("cycle", self.cycle, "Cycle time of the controller [s].");
    visit("joint", self.joint, "Joint servo: one for all joints, or one per joint; empty when unknown.");
    visit(
        "torque", self.torque,
        "Torque servo, in place of the joint servo: one for all joints, or one per joint; empty where there is none.");
    visit("tool", self.tool, "Servo of the path correction.");
    visit("correction", self.correction, "Mode and limits of the path correction; absent: absolute, without limits.");
  }
};

}  // namespace kr5::cell
