// SPDX-License-Identifier: BSD-3-Clause
#include "cell/effect_rows.hpp"

#include <limits>
#include <numbers>

namespace kr5::cell {
namespace {

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double turn = 2 * std::numbers::pi;

template <auto Member>
SlotAccess joint() {
  return {[](Effects& e, int i) -> Slot {
            if (e.joints.size() <= static_cast<std::size_t>(i)) e.joints.resize(static_cast<std::size_t>(i) + 1);
            return &(e.joints[static_cast<std::size_t>(i)].*Member);
          },
          [](const Effects& e, int i) -> ConstSlot { return &(e.joint(i).*Member); }};
}

template <auto Member>
SlotAccess motor() {
  return {[](Effects& e, int i) -> Slot {
            if (e.motors.size() <= static_cast<std::size_t>(i)) e.motors.resize(static_cast<std::size_t>(i) + 1);
            return &(e.motors[static_cast<std::size_t>(i)].*Member);
          },
          [](const Effects& e, int i) -> ConstSlot { return &(e.motor(i).*Member); }};
}

template <auto Member>
SlotAccess wrench() {
  return {[](Effects& e, int i) -> Slot { return &(e.wrench.at(static_cast<std::size_t>(i)).*Member); },
          [](const Effects& e, int i) -> ConstSlot { return &(e.wrench.at(static_cast<std::size_t>(i)).*Member); }};
}

template <auto Part, auto Member>
SlotAccess part() {
  return {[](Effects& e, int) -> Slot { return &(e.*Part.*Member); },
          [](const Effects& e, int) -> ConstSlot { return &(e.*Part.*Member); }};
}

template <auto Member>
SlotAccess tool() {
  return part<&Effects::tool, Member>();
}
template <auto Member>
SlotAccess arm() {
  return part<&Effects::arm, Member>();
}
template <auto Member>
SlotAccess sensor() {
  return part<&Effects::sensors, Member>();
}
template <auto Member>
SlotAccess task() {
  return part<&Effects::task, Member>();
}

struct Parameter {
  const char *name, *unit;
  double lower, upper;
  SlotAccess slot;
  const char* description;
  bool required = true;
};

template <class T>
EffectValueKind kind_of(const T*) {
  if constexpr (std::is_same_v<T, int>)
    return EffectValueKind::Whole;
  else if constexpr (std::is_same_v<T, Eigen::Vector2d>)
    return EffectValueKind::Vector2;
  else if constexpr (std::is_same_v<T, Eigen::Vector3d>)
    return EffectValueKind::Vector3;
  else if constexpr (std::is_same_v<T, std::optional<Pose>>)
    return EffectValueKind::Pose;
  else
    return EffectValueKind::Number;
}

std::vector<double> numbers_of(const std::optional<EffectValue>& value) {
  if (!value) return {};
  if (const auto* number = std::get_if<double>(&*value)) return {*number};
  const auto& v = std::get<Eigen::VectorXd>(*value);
  return {v.begin(), v.end()};
}

/// Kind and off value are those of the slot itself.
EffectRow row(const char* id, EffectTarget target, const char* description, const std::vector<Parameter>& parameters) {
  const Effects off;
  EffectRow out{{id, target, description, {}}, {}};
  for (const Parameter& p : parameters) {
    const ConstSlot slot = p.slot.read(off, 0);
    const auto value = read_slot(slot);
    out.effect.parameters.push_back({p.name, std::visit([](const auto* at) { return kind_of(at); }, slot), p.unit,
                                     !value.has_value(), numbers_of(value), p.lower, p.upper, p.required,
                                     p.description});
    out.slots.push_back(p.slot);
  }
  return out;
}

using J = JointEffects;
using W = WrenchEffects;
using S = SensorEffects;
using K = TaskEffects;

std::vector<EffectRow> drive_rows() {
  using enum EffectTarget;
  return {
      row("coulomb_friction", Joint, "friction level differs",
          {{"coulomb", "N m", 0, 1e5, joint<&J::coulomb>(), "level of the dry friction"}}),
      row("viscous_friction", Joint, "viscous slope differs",
          {{"viscous", "N m s/rad", 0, 1e5, joint<&J::viscous>(), "slope of the friction over speed"}}),
      row("stribeck_friction", Joint, "extra friction at low speed, s exp(-(v/vs)^2)",
          {{"stribeck", "N m", 0, 1e5, joint<&J::stribeck>(), "s, added to the dry friction at standstill"},
           {"stribeck_velocity", "rad/s", 1e-5, 100, joint<&J::stribeck_velocity>(), "vs, where it fades"}}),
      row("load_friction", Joint, "friction that grows with the transmitted torque",
          {{"coefficient", "-", 0, 1, joint<&J::load_coefficient>(), "friction over transmitted torque"}}),
      row("thermal_friction", Joint, "friction falls as the gear warms",
          {{"drop", "-", 0, 1, joint<&J::thermal_drop>(), "part of the friction that is lost when warm"},
           {"time_constant", "s", 1e-3, 1e6, joint<&J::thermal_time_constant>(), "of the warming"}}),
      row("joint_elasticity", Joint, "spring between motor and link",
          {{"stiffness", "N m/rad", 1, inf, joint<&J::elasticity>(), "of the spring; infinite: rigid"}}),
      row("backlash", Joint, "free play between motor and link",
          {{"gap", "rad", 0, 0.2, joint<&J::backlash>(), "whole width of the play"}}),
      row("torque_constant", Joint, "current-to-torque scale differs",
          {{"torque_constant", "N m/A", 1e-6, 1e4, joint<&J::torque_constant>(), "motor torque over current"}}),
      row("rotor_inertia", Joint, "reflected rotor inertia differs",
          {{"rotor_inertia", "kg m^2", 0, 100, joint<&J::rotor_inertia>(), "motor side"}}),
      row("cable_spring", Joint, "dress pack pulls like a spring",
          {{"stiffness", "N m/rad", 0, 1e5, joint<&J::cable_stiffness>(), "of the dress pack"},
           {"rest", "rad", -4 * turn, 4 * turn, joint<&J::cable_rest>(), "joint angle at which it does not pull"}}),
      row("torque_ripple", Joint, "torque periodic in joint angle, amplitude sin(cycles q + phase)",
          {{"amplitude", "N m", -1e4, 1e4, joint<&J::ripple_amplitude>(), "of the ripple"},
           {"cycles", "-", 1, 1e4, joint<&J::ripple_cycles>(), "periods a turn of the joint"},
           {"phase", "rad", -turn, turn, joint<&J::ripple_phase>(), "at joint angle 0", false}}),
      row("wrist_coupling", Motor, "a coupling term of the structure matrix differs, between torque and current",
          {{"element", "-", 0, 99, motor<&MotorEffects::coupling_element>(), "column of the structure matrix, from 0"},
           {"value", "-", -1e4, 1e4, motor<&MotorEffects::coupling_value>(), "value of that element"}}),
  };
}

std::vector<EffectRow> arm_rows() {
  using enum EffectTarget;
  return {
      row("payload", Tool, "something more hangs on the tool",
          {{"mass", "kg", 0, 1e3, tool<&ToolEffects::payload_mass>(), "of what hangs there"},
           {"com", "m", -5, 5, tool<&ToolEffects::payload_com>(), "its centre of mass in S"}}),
      row("base_tilt", Base, "robot stands tilted: pose and gravity",
          {{"roll", "rad", -0.5, 0.5, arm<&ArmEffects::base_roll>(), "of Ry(pitch) Rx(roll)"},
           {"pitch", "rad", -0.5, 0.5, arm<&ArmEffects::base_pitch>(), "of Ry(pitch) Rx(roll)"}}),
      row("encoder_offset", Joint, "joint zero is wrong",
          {{"offset", "rad", -turn, turn, joint<&J::encoder_offset>(), "true angle less reading"}}),
      row("link_length", Joint, "a DH length differs",
          {{"a", "m", -10, 10, joint<&J::a>(), "DH length a", false},
           {"b", "m", -10, 10, joint<&J::b>(), "DH offset b", false}}),
      row("link_twist", Joint, "a DH twist differs",
          {{"alpha", "rad", -turn, turn, joint<&J::alpha>(), "DH twist alpha"}}),
      row("transmission_error", Joint, "gear eccentricity: amplitude sin(cycles q + phase) on the joint angle",
          {{"amplitude", "rad", -0.2, 0.2, joint<&J::transmission_amplitude>(), "of the angle error"},
           {"cycles", "-", 1, 1e4, joint<&J::transmission_cycles>(), "periods a turn of the joint"},
           {"phase", "rad", -turn, turn, joint<&J::transmission_phase>(), "at joint angle 0", false}}),
      row("tool_offset", Tool, "tool tip is elsewhere",
          {{"offset", "m", -2, 2, tool<&ToolEffects::offset>(), "added to T_F_E, along E; camera and scanner stay"}}),
      row("thermal_growth", Links, "links grow as the robot warms up over the session",
          {{"growth", "-", -0.05, 0.05, arm<&ArmEffects::growth>(), "of all DH lengths when warm"},
           {"time_constant", "s", 1e-3, 1e6, arm<&ArmEffects::growth_time_constant>(), "of the warming"}}),
      row("current_delay", Drives, "currents are logged late against positions",
          {{"delay", "s", 0, 1, arm<&ArmEffects::current_delay>(), "of the logged currents"}}),
      row("joint_servo", Joint, "axis bandwidth differs",
          {{"natural_frequency", "rad/s", 0.1, 1e4, joint<&J::natural_frequency>(), "of the axis"}}),
      row("joint_delay", Drives, "motion command acts later",
          {{"delay", "s", 0, 2, arm<&ArmEffects::joint_delay>(), "in all, from command to motion"}}),
      row("tool_servo", Servo, "path-correction bandwidth differs",
          {{"natural_frequency", "rad/s", 0.01, 1e4, arm<&ArmEffects::tool_frequency>(), "of the path correction"}}),
      row("tool_damping", Servo, "path-correction damping differs",
          {{"damping_ratio", "-", 0.01, 20, arm<&ArmEffects::tool_damping>(), "of the path correction"}}),
      row("tool_delay", Servo, "path-correction latency differs",
          {{"delay", "s", 0, 2, arm<&ArmEffects::tool_delay>(), "in all, from command to motion"}}),
  };
}

std::vector<EffectRow> sensor_rows() {
  using enum EffectTarget;
  return {
      row("ft_bias", WrenchComponent, "sensor offset",
          {{"bias", "N or N m", -1e4, 1e4, wrench<&W::bias>(), "added to the component"}}),
      row("ft_drift", WrenchComponent, "sensor drifts with t",
          {{"rate", "N/s or N m/s", -100, 100, wrench<&W::rate>(), "of the component over t"}}),
      row("ft_gain", WrenchComponent, "sensor scale differs",
          {{"gain", "-", 0, 100, wrench<&W::gain>(), "the factor itself, 1 nominal"}}),
      row("ft_crosstalk", WrenchComponent, "one component leaks into another: component += gain source",
          {{"source", "-", 0, 5, wrench<&W::source>(), "component that leaks in, fx to tz from 0"},
           {"gain", "-, m or 1/m", -100, 100, wrench<&W::crosstalk_gain>(), "how much of it"}}),
      row("ft_lag", ForceTorque, "sensor filter lag",
          {{"time_constant", "s", 0, 10, sensor<&S::ft_lag>(), "of the filter"}}),
      row("camera_focal", Camera, "focal length differs",
          {{"fx", "px", 1, 1e6, sensor<&S::fx>(), "along x", false},
           {"fy", "px", 1, 1e6, sensor<&S::fy>(), "along y", false}}),
      row("lens_distortion", Camera, "distortion differs",
          {{"k1", "-", -10, 10, sensor<&S::k1>(), "radial, rho", false},
           {"k2", "-", -100, 100, sensor<&S::k2>(), "radial, rho^2", false}}),
      row("hand_eye", Camera, "camera mount differs",
          {{"T_E_C", "m, rad", -inf, inf, sensor<&S::T_E_C>(), "camera in the nominal tool tip"}}),
      row("laser_mount", Laser, "scanner mount differs",
          {{"T_E_L", "m, rad", -inf, inf, sensor<&S::T_E_L>(), "scanner in the nominal tool tip"}}),
      row("laser_bias", Laser, "range error that grows away from the best stand-off, bias ((z - 0.19 m) / 0.05 m)^2",
          {{"bias", "m", -0.1, 0.1, sensor<&S::laser_bias>(), "0.05 m away from the best stand-off"}}),
      row("laser_lag", Laser, "profile is late against the robot position",
          {{"lag", "s", -1, 1, sensor<&S::laser_lag>(), "the profile was taken speed lag further back along Y"}}),
  };
}

std::vector<EffectRow> task_rows() {
  using enum EffectTarget;
  return {
      row("contact_stiffness", Contact, "contact is softer or harder",
          {{"stiffness", "N/m", 1, 1e9, task<&K::stiffness>(), "of all that gives way"}}),
      row("contact_hardening", Contact, "stiffness grows with depth, k p (1 + h p / 1 mm)",
          {{"hardening", "1/mm", -10, 100, task<&K::hardening>(), "h, per mm of depth"}}),
      row("contact_friction", Contact, "peg-tube friction differs",
          {{"friction", "-", 0, 5, task<&K::friction>(), "coefficient"}}),
      row("gripper_compliance", Gripper, "the grip gives way under load",
          {{"lateral", "m/N", 0, 1e-2, task<&K::lateral>(), "across the peg", false},
           {"axial", "m/N", 0, 1e-2, task<&K::axial>(), "along the peg, in series with the contact", false}}),
      row("tube_tilt", Tube, "tube stands tilted",
          {{"tilt", "rad", -0.8, 0.8, task<&K::tube_tilt>(), "about X then Y of T"}}),
      row("tube_shift", Tube, "tube is elsewhere",
          {{"shift", "m", -1, 1, task<&K::tube_shift>(), "along X Y (Z) of T"}}),
      row("tube_radius", Tube, "tube is of another bore",
          {{"inner_radius", "m", 1e-5, 1, task<&K::tube_radius>(), "radius of the bore"}}),
  };
}

}  // namespace

const std::vector<EffectRow>& effect_rows() {
  static const std::vector<EffectRow> all = [] {
    std::vector<EffectRow> out;
    for (const auto& part : {drive_rows(), arm_rows(), sensor_rows(), task_rows()})
      out.insert(out.end(), part.begin(), part.end());
    return out;
  }();
  return all;
}

}  // namespace kr5::cell
