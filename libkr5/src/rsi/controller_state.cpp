// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/controller_state.hpp>

#include <algorithm>
#include <limits>

#include <kr5/rsi/kuka_pose.hpp>

#include "rsi/wire_units.hpp"

namespace kr5::rsi {
namespace {

constexpr double percent = 0.01;
constexpr double all_bits = 4294967295.0;  // of 32

std::uint32_t bits_of(double value) noexcept {
  if (value < 0.0 && value >= -2147483648.0) return static_cast<std::uint32_t>(static_cast<std::int32_t>(value));
  return value > 0.0 && value <= all_bits ? static_cast<std::uint32_t>(value) : 0;
}

}  // namespace

TelegramUnits::Places::Places(const std::vector<TelegramField>& fields) {
  for (auto& of_meaning : place) of_meaning.fill(-1);
  for (std::size_t i = 0; i < fields.size(); ++i) {
    int& at = place[static_cast<std::size_t>(fields[i].meaning)][static_cast<std::size_t>(fields[i].component)];
    if (at < 0) at = static_cast<int>(i);
  }
}

bool TelegramUnits::Places::has(Meaning meaning) const noexcept {
  return std::ranges::any_of(place[static_cast<std::size_t>(meaning)], [](int at) { return at >= 0; });
}

TelegramUnits::TelegramUnits(const TelegramLayout& layout)
    : send_((layout.validate(), telegram_fields(layout.send))),
      receive_(telegram_fields(layout.receive)),
      externals_(layout.externals),
      reads_currents_(!layout.current_units.empty()),
      gripper_(layout.gripper) {
  units_.fill(degree);
  for (const int axis : layout.linear_externals) units_[static_cast<std::size_t>(5 + axis)] = millimetre;
  std::ranges::copy(layout.current_units, current_units_.begin());
  signs_.fill(1.0);
  counts_otherwise_ = layout.axes.has_value();
  for (int i = 0; layout.axes && i < joints(); ++i) {
    signs_[static_cast<std::size_t>(i)] = layout.axes->sign[i];
    zeros_[static_cast<std::size_t>(i)] = layout.axes->zero[i];
  }
}

/// Joint value of an axis [rad or m]; both are the same where the controller counts as the joints do.
double TelegramUnits::joint_of(int joint, double axis, Counting counting) const noexcept {
  if (!counts_otherwise_) return axis;
  return sign(joint) * axis + (counting == Counting::Place ? zeros_[static_cast<std::size_t>(joint)] : 0.0);
}

double TelegramUnits::axis_of(int joint, double value, Counting counting) const noexcept {
  if (!counts_otherwise_) return value;
  const double zero = counting == Counting::Place ? zeros_[static_cast<std::size_t>(joint)] : 0.0;
  return sign(joint) * (value - zero) + 0.0;  // no -0
}

std::optional<double> TelegramUnits::value(const Places& in, const Telegram& t, Meaning meaning,
                                           int component) const noexcept {
  const int at = in.of(meaning, component);
  if (at < 0 || !t.present[static_cast<std::size_t>(at)]) return std::nullopt;
  return t.values[static_cast<std::size_t>(at)];
}

std::optional<Pose> TelegramUnits::pose(const Places& in, const Telegram& t, Meaning meaning) const noexcept {
  if (!in.has(meaning)) return std::nullopt;
  Vector6 v;
  for (int i = 0; i < 6; ++i) v[i] = value(in, t, meaning, i).value_or(0.0);
  return from_kuka(v);
}

robot::JointVector TelegramUnits::joint_values(const Places& in, const Telegram& t, Meaning axes, Meaning externals,
                                               Counting counting) const noexcept {
  robot::JointVector out;
  if (!in.has(axes) && !in.has(externals)) return out;
  out.resize(joints());
  for (int i = 0; i < joints(); ++i)
    out[i] = joint_of(i, unit(i) * value(in, t, i < 6 ? axes : externals, i % 6).value_or(0.0), counting);
  return out;
}

robot::JointVector TelegramUnits::motor_currents(const Telegram& t) const noexcept {
  robot::JointVector out;
  if (!reads_currents_ || !send_.has(Meaning::MotorCurrent)) return out;
  out.resize(joints());
  for (int i = 0; i < joints(); ++i)
    out[i] = sign(i) * current_units_[static_cast<std::size_t>(i)] *
             value(send_, t, i < 6 ? Meaning::MotorCurrent : Meaning::ExternalCurrent, i % 6).value_or(0.0);
  return out;
}

ControllerState TelegramUnits::state(const Telegram& t) const noexcept {
  ControllerState out;
  out.tool = pose(send_, t, Meaning::CartesianActual);
  out.tool_setpoint = pose(send_, t, Meaning::CartesianSetpoint);
  out.joints = joint_values(send_, t, Meaning::AxisActual, Meaning::ExternalActual, Counting::Place);
  out.joint_setpoints = joint_values(send_, t, Meaning::AxisSetpoint, Meaning::ExternalSetpoint, Counting::Place);
  if (send_.has(Meaning::GearTorque)) {
    out.efforts = robot::JointVector::Zero(joints());
    for (int i = 0; i < 6; ++i) out.efforts[i] = sign(i) * value(send_, t, Meaning::GearTorque, i).value_or(0.0);
  }
  out.currents = motor_currents(t);
  if (send_.has(Meaning::SensorWrench)) {
    out.sensor = Vector6::Zero();
    for (int i = 0; i < 6; ++i) (*out.sensor)[i] = value(send_, t, Meaning::SensorWrench, i).value_or(0.0);
  }
  out.late_packets = value(send_, t, Meaning::LatePackets);
  out.program_state = value(send_, t, Meaning::ProgramState);
  if (const auto found = value(send_, t, Meaning::Override)) out.override_share = percent * *found;
  if (const auto found = value(send_, t, Meaning::DigitalInputs)) {
    out.digital_inputs = bits_of(*found);
    if (gripper_.gripped) out.gripped = (out.digital_inputs >> *gripper_.gripped & 1U) != 0;
  }
  return out;
}

void TelegramUnits::put(const Places& in, Telegram& t, Meaning meaning, int component, double value) const noexcept {
  const int at = in.of(meaning, component);
  if (at < 0) return;
  t.values[static_cast<std::size_t>(at)] = value;
  t.present[static_cast<std::size_t>(at)] = true;
}

void TelegramUnits::put_pose(const Places& in, Telegram& t, Meaning meaning, const Pose& T) const noexcept {
  if (!in.has(meaning)) return;
  const Vector6 v = to_kuka(T);
  for (int i = 0; i < 6; ++i) put(in, t, meaning, i, v[i]);
}

void TelegramUnits::put_joints(const Places& in, Telegram& t, Meaning axes, Meaning externals,
                               const robot::JointVector& values, Counting counting) const noexcept {
  for (int i = 0; i < std::min(static_cast<int>(values.size()), joints()); ++i)
    put(in, t, i < 6 ? axes : externals, i % 6, axis_of(i, values[i], counting) / unit(i));
}

void TelegramUnits::set_correction(const Correction& c, Telegram& t) const noexcept {
  t.values.fill(0.0);
  t.present.set();
  put_joints(receive_, t, Meaning::AxisCorrection, Meaning::ExternalCorrection, c.joints, Counting::Difference);
  if (c.tool) put_pose(receive_, t, Meaning::CartesianCorrection, *c.tool);
  std::uint32_t bits = (c.gripper.hold ? 1U << gripper_.hold : 0U) | (c.gripper.air ? 1U << gripper_.air : 0U);
  if (gripper_.fingers && c.gripper.fingers) bits |= 1U << *gripper_.fingers;
  put(receive_, t, Meaning::DigitalOutputs, 0, bits);
  put(receive_, t, Meaning::StopMove, 0, c.stop_move ? 1.0 : 0.0);
}

Correction TelegramUnits::correction(const Telegram& t) const noexcept {
  Correction out;
  out.joints = joint_values(receive_, t, Meaning::AxisCorrection, Meaning::ExternalCorrection, Counting::Difference);
  out.tool = pose(receive_, t, Meaning::CartesianCorrection);
  if (const auto found = value(receive_, t, Meaning::DigitalOutputs)) {
    const std::uint32_t bits = bits_of(*found);
    out.gripper = {.hold = (bits >> gripper_.hold & 1U) != 0, .air = (bits >> gripper_.air & 1U) != 0};
    out.gripper.fingers = gripper_.fingers && (bits >> *gripper_.fingers & 1U) != 0;
  }
  out.stop_move = value(receive_, t, Meaning::StopMove).value_or(0.0) != 0.0;
  return out;
}

void TelegramUnits::set_state(const ControllerState& s, Telegram& t) const noexcept {
  if (s.tool) put_pose(send_, t, Meaning::CartesianActual, *s.tool);
  if (s.tool_setpoint) put_pose(send_, t, Meaning::CartesianSetpoint, *s.tool_setpoint);
  put_joints(send_, t, Meaning::AxisActual, Meaning::ExternalActual, s.joints, Counting::Place);
  put_joints(send_, t, Meaning::AxisSetpoint, Meaning::ExternalSetpoint, s.joint_setpoints, Counting::Place);
  for (int i = 0; i < std::min<int>(6, static_cast<int>(s.efforts.size())); ++i)
    put(send_, t, Meaning::GearTorque, i, sign(i) * s.efforts[i]);
  for (int i = 0; reads_currents_ && i < std::min(static_cast<int>(s.currents.size()), joints()); ++i) {
    const double ampere = current_units_[static_cast<std::size_t>(i)];
    if (ampere != 0.0)
      put(send_, t, i < 6 ? Meaning::MotorCurrent : Meaning::ExternalCurrent, i % 6, sign(i) * s.currents[i] / ampere);
  }
  for (int i = 0; s.sensor && i < 6; ++i) put(send_, t, Meaning::SensorWrench, i, (*s.sensor)[i]);
  if (s.late_packets) put(send_, t, Meaning::LatePackets, 0, *s.late_packets);
  if (s.program_state) put(send_, t, Meaning::ProgramState, 0, *s.program_state);
  if (s.override_share) put(send_, t, Meaning::Override, 0, *s.override_share / percent);
  std::uint32_t bits = s.digital_inputs;
  if (gripper_.gripped && s.gripped) {
    const std::uint32_t bit = 1U << *gripper_.gripped;
    bits = *s.gripped ? bits | bit : bits & ~bit;
  }
  put(send_, t, Meaning::DigitalInputs, 0, bits);
}

robot::RobotReading robot_reading(const ControllerState& state, const robot::SensorModel& model, double time) noexcept {
  robot::SensorValues values;
  values.time = time;
  values.joints = state.joints;
  values.efforts = state.efforts;
  values.currents = state.currents;
  if (state.sensor) values.sensor = *state.sensor;
  values.status.gripped = state.gripped.value_or(true);
  values.status.stopped = state.program_state.value_or(program_active) != program_active;
  const bool same_arm =
      state.joints.size() > 0 && static_cast<std::size_t>(state.joints.size()) == model.arm.joints.size();
  if (same_arm) {
    robot::RobotReading out = robot::robot_reading(model, values);
    if (state.tool) out.pose_mismatch = (state.tool->translation() - out.T_base_tool.translation()).norm();
    return out;
  }
  Pose T_base_tool = Pose::Identity();
  if (state.tool)
    T_base_tool = *state.tool;
  else
    T_base_tool.matrix().setConstant(std::numeric_limits<double>::quiet_NaN());
  return robot::robot_reading(model, values, T_base_tool * model.T_flange_tool.inverse());
}

}  // namespace kr5::rsi
