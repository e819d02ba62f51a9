// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/rsi/controller_axes.hpp>

/// @file
/// What a KUKA controller and a computer tell each other over the RobotSensorInterface (RSI): names, order and types of
/// the elements of both telegrams, as the controller's own configuration lists them. Once a cycle the controller sends
/// @code
/// <Rob TYPE="KUKA"><RIst X="1.0" ... C="0.0" /><AIPos A1="0.1" ... A6="0.6" /><Delay D="0" /><IPOC>123</IPOC></Rob>
/// @endcode
/// and the computer answers with the same IPOC
/// @code
/// <Sen Type="ImFree"><AK A1="0.0" ... A6="0.0" /><IPOC>123</IPOC></Sen>
/// @endcode

namespace kr5::rsi {

/// A controller, with the version of its RSI.
enum class Controller {
  Krc2,      ///< KR C2, RSI 2.3 with Ethernet RSI XML; every 12 ms.
  Krc4Rsi3,  ///< KR C4, RSI 3.
  Krc4,      ///< KR C4, RSI 4.
  Krc5,      ///< KR C5, RSI 5.
  Iiqka,     ///< KR C5 with iiQKA.OS, RSI 6.
};
constexpr auto enum_names(Controller) {
  using enum Controller;
  return names<Controller>({{Krc2, "krc2"}, {Krc4Rsi3, "krc4_rsi3"}, {Krc4, "krc4"}, {Krc5, "krc5"}, {Iiqka, "iiqka"}});
}

enum class Transport { Udp, Tcp };
constexpr auto enum_names(Transport) { return names<Transport>({{Transport::Udp, "udp"}, {Transport::Tcp, "tcp"}}); }

/// TYPE of an element.
enum class ValueType { Bool, Long, Float, Double, String };
constexpr auto enum_names(ValueType) {
  using enum ValueType;
  return names<ValueType>({{Bool, "bool"}, {Long, "long"}, {Float, "float"}, {Double, "double"}, {String, "string"}});
}

/// What an element means. The names of internal elements (DEF_...) are the controller's; all others are free, and what
/// theirs usually mean is assumed (`usual_meaning`).
enum class Meaning {
  Other,                ///< A number that is handed on under its name.
  CartesianActual,      ///< X Y Z A B C of the active tool in the active base [mm, deg on the wire].
  CartesianSetpoint,    ///< The same of the programmed path, without corrections.
  AxisActual,           ///< A1 to A6 [deg].
  AxisSetpoint,         ///< The same of the programmed path, without corrections.
  ExternalActual,       ///< E1 to E6 [deg or mm].
  ExternalSetpoint,     ///< The same of the programmed path.
  MotorCurrent,         ///< Of A1 to A6, in the controller's unit.
  ExternalCurrent,      ///< Of E1 to E6.
  GearTorque,           ///< Of A1 to A6 [N m].
  LatePackets,          ///< Number of answers that came too late.
  Technology,           ///< Ten parameters of a function generator.
  Message,              ///< A text that the controller shows.
  ProgramState,         ///< $PRO_STATE.
  Override,             ///< $OV_PRO [%].
  DigitalInputs,        ///< Bits.
  DigitalOutputs,       ///< Bits.
  StopMove,             ///< Ends RSI_MOVECORR.
  CartesianCorrection,  ///< X Y Z A B C [mm, deg].
  AxisCorrection,       ///< A1 to A6 [deg].
  ExternalCorrection,   ///< E1 to E6 [deg or mm].
  SensorWrench,         ///< Fx Fy Fz Tx Ty Tz of a force/torque sensor, in its own axes [N, N m].
};
constexpr auto enum_names(Meaning) {
  using enum Meaning;
  return names<Meaning>({{Other, "other"},
                         {CartesianActual, "cartesian_actual"},
                         {CartesianSetpoint, "cartesian_setpoint"},
                         {AxisActual, "axis_actual"},
                         {AxisSetpoint, "axis_setpoint"},
                         {ExternalActual, "external_actual"},
                         {ExternalSetpoint, "external_setpoint"},
                         {MotorCurrent, "motor_current"},
                         {ExternalCurrent, "external_current"},
                         {GearTorque, "gear_torque"},
                         {LatePackets, "late_packets"},
                         {Technology, "technology"},
                         {Message, "message"},
                         {ProgramState, "program_state"},
                         {Override, "override"},
                         {DigitalInputs, "digital_inputs"},
                         {DigitalOutputs, "digital_outputs"},
                         {StopMove, "stop_move"},
                         {CartesianCorrection, "cartesian_correction"},
                         {AxisCorrection, "axis_correction"},
                         {ExternalCorrection, "external_correction"},
                         {SensorWrench, "sensor_wrench"}});
}

/// What an element of this name means where nothing else is stated: "AKorr" and "AK" are corrections of the axes.
Meaning usual_meaning(std::string_view element) noexcept;

/// One <ELEMENT> of the controller's configuration.
struct TelegramElement {
  std::string tag;  ///< "DEF_RIst", "AK.A1", "DiO".
  ValueType type = ValueType::Double;
  std::optional<int> index = {};  ///< Channel of the Ethernet object; without, internal.
  std::optional<bool> hold = {};  ///< HOLDON.
  std::string unit = {};          ///< UNIT of RSI 2, as written.
  std::optional<Meaning> meaning = {};

  static void each_field(auto& self, auto&& visit) {
    visit("tag", self.tag, "Name in the configuration: DEF_RIst, AK.A1, DiO.");
    visit("type", self.type, "Type of the value: bool | long | float | double | string.");
    visit("index", self.index, "Channel of the Ethernet object, 1 to 64; none: an internal value (DEF_...).");
    visit("hold", self.hold, "HOLDON: true keeps the last value while no answer comes, false resets it.");
    visit("unit", self.unit, "UNIT of RSI 2, as written.");
    visit("meaning", self.meaning, "What the element means; none: what its name usually means.");
  }
};

/// Bits of the digital inputs and outputs that belong to the gripper, from 0.
struct GripperBits {
  int hold = 0;                     ///< Output: it holds its part.
  int air = 1;                      ///< Output: compressed air.
  std::optional<int> fingers = {};  ///< Output: of a tool that has a suction cup, too, the fingers close.
  std::optional<int> gripped = {};  ///< Input: it holds something.

  static void each_field(auto& self, auto&& visit) {
    visit("hold", self.hold, "Bit of the digital outputs that closes the gripper.");
    visit("air", self.air, "Bit of the digital outputs that blows compressed air.");
    visit("fingers", self.fingers,
          "Bit of the digital outputs by which the fingers close and not the suction cup; none: the tool has one "
          "gripper.");
    visit("gripped", self.gripped, "Bit of the digital inputs that tells that something is held; none: not measured.");
  }
};

/// Both telegrams and the socket that they go through.
struct TelegramLayout {
  Controller controller = Controller::Krc4;
  std::string address = "192.168.1.60";  ///< Of the computer.
  int port = 49152;
  Transport transport = Transport::Udp;
  std::string sensor_type = "ImFree";  ///< Of <Sen Type="...">.
  bool only_send = false;
  std::vector<TelegramElement> send;     ///< What the controller sends.
  std::vector<TelegramElement> receive;  ///< What it receives.
  int decimals = 4;                      ///< Of what the controller sends.
  int externals = 0;
  std::vector<int> linear_externals = {};
  std::vector<double> current_units = {};  ///< [A]
  GripperBits gripper = {};
  std::optional<ControllerAxes> axes = {};

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("controller", self.controller, "Controller: krc2 | krc4_rsi3 | krc4 | krc5 | iiqka.");
    visit("address", self.address, "IP address of the computer, to which the controller sends.");
    visit("port", self.port, "Port of the computer.");
    visit("transport", self.transport, "Transport: udp | tcp (KR C2 alone).");
    visit("sensor_type", self.sensor_type, "SENTYPE, the Type of the answer.");
    visit("only_send", self.only_send, "True where the controller expects no answers.");
    visit("send", self.send, "Elements that the controller sends, in their order.");
    visit("receive", self.receive, "Elements that the controller receives, in their order.");
    visit("decimals", self.decimals, "Decimals of the numbers that the controller sends.");
    visit("externals", self.externals, "Number of external axes that belong to the robot, behind its six axes.");
    visit("linear_externals", self.linear_externals, "Numbers of the external axes that are linear, from 1.");
    visit("current_units", self.current_units,
          "Amperes of one unit of the motor current of each axis; empty: not known, currents are not read [A].");
    visit("gripper", self.gripper, "Bits of the gripper in the digital inputs and outputs.");
    visit("axes", self.axes,
          "Directions and zeros of the controller's axes, external ones included; none: as the joints.");
  }
};

/// One value of a telegram.
struct TelegramField {
  std::string element;    ///< "RIst"
  std::string attribute;  ///< "X"; empty: the value is the text of the element.
  ValueType type = ValueType::Double;
  Meaning meaning = Meaning::Other;
  int component = 0;  ///< Of the meaning, from 0: X is 0, A1 is 0.

  static void each_field(auto& self, auto&& visit) {
    visit("element", self.element, "Name of the XML element.");
    visit("attribute", self.attribute, "Name of the attribute; empty: the value is the text of the element.");
    visit("type", self.type, "Type of the value.");
    visit("meaning", self.meaning, "What the value means.");
    visit("component", self.component, "Which component of the meaning it is, from 0.");
  }
};

/// Most values of a telegram.
inline constexpr int max_values = 160;

/// The values of a telegram in the order in which they stand in it: internal elements have several, elements of tags
/// with a dot are joined where the first of them stands. IPOC, which ends every telegram, is not among them.
/// @throws InvalidArgument naming the element that is no telegram's.
std::vector<TelegramField> telegram_fields(const std::vector<TelegramElement>& elements);

/// What corrections move.
enum class CorrectionSpace { Axes, Cartesian };
constexpr auto enum_names(CorrectionSpace) {
  return names<CorrectionSpace>({{CorrectionSpace::Axes, "axes"}, {CorrectionSpace::Cartesian, "cartesian"}});
}

/// Poses, axes, motor currents and late packets in; corrections and the bits of a gripper out. Over UDP.
TelegramLayout usual_layout(Controller controller, CorrectionSpace space = CorrectionSpace::Axes);
/// What a job from bin to tube needs: Cartesian corrections; besides, the force/torque sensor, the state of the program
/// and the digital inputs with the bit `gripped` in, the bit `fingers` and the end of the motion out.
TelegramLayout job_layout(Controller controller);
/// That of the book's KR C2 (Appendix C): over TCP to port 6008, corrections of both kinds.
TelegramLayout book_layout();

}  // namespace kr5::rsi
