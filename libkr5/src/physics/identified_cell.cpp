// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/identified_cell.hpp>

#include <array>
#include <string>
#include <vector>

#include <kr5/core/error.hpp>
#include <kr5/physics/servo.hpp>

namespace kr5::physics {

namespace {

void require_joint(const cell::Cell& cell, int joint) {
  const int n = cell.robot.joints();
  require(joint >= 0 && joint < n,
          "joint: found " + std::to_string(joint) + ", expected 0 to " + std::to_string(n - 1));
}

}  // namespace

void set_path_servo(cell::Cell& cell, const cell::SecondOrder& servo, double cycle) {
  if (!cell.servo) cell.servo = cell::Servo{.cycle = cycle, .joint = {}, .tool = {}, .correction = {}};
  cell.servo->tool = servo;
  for (const char* effect : {"tool_servo", "tool_damping", "tool_delay"}) cell.effects.remove(effect);
}

void set_joint_servo(cell::Cell& cell, int joint, const cell::SecondOrder& servo, double cycle) {
  require_joint(cell, joint);
  const int n = cell.robot.joints();
  std::vector<cell::SecondOrder> all = joint_servos(cell);
  if (all.empty()) all.assign(static_cast<std::size_t>(n), servo);
  all[static_cast<std::size_t>(joint)] = servo;
  if (!cell.servo) cell.servo = cell::Servo{.cycle = cycle, .joint = {}, .tool = {}, .correction = {}};
  cell.servo->joint = all;
  for (const char* effect : {"joint_servo", "joint_delay"}) cell.effects.remove(effect);
}

void set_joint_spring(cell::Cell& cell, int joint, double stiffness, double gap) {
  require_joint(cell, joint);
  const std::string name = "joint" + std::to_string(joint + 1);
  cell.effects.set("joint_elasticity", name, "stiffness", stiffness);
  cell.effects.set("backlash", name, "gap", gap);
}

void set_contact_stiffness(cell::Cell& cell, double stiffness) {
  if (!cell.contact) cell.contact = cell::Contact{};
  cell.contact->stiffness = stiffness;
  cell.effects.remove("contact_stiffness");
}

void set_tool_mass(cell::Cell& cell, double mass, const Eigen::Vector3d& com) {
  if (!cell.tool) cell.tool = cell::Tool{};
  cell.tool->mass = mass;
  cell.tool->com = com;
  cell.effects.remove("payload");
}

void set_wrench_sensor(cell::Cell& cell, const WrenchSensor& sensor) {
  for (const char* effect : {"ft_bias", "ft_drift", "ft_gain", "ft_crosstalk"}) cell.effects.remove(effect);
  constexpr std::array components = {"fx", "fy", "fz", "tx", "ty", "tz"};
  for (Eigen::Index c = 0; c < 6; ++c) {
    const std::string name = components[static_cast<std::size_t>(c)];
    if (sensor.bias[c] != 0.0) cell.effects.set("ft_bias", name, "bias", sensor.bias[c]);
    if (sensor.rate[c] != 0.0) cell.effects.set("ft_drift", name, "rate", sensor.rate[c]);
    if (sensor.gain(c, c) != 1.0) cell.effects.set("ft_gain", name, "gain", sensor.gain(c, c));
    Vector6 beside = sensor.gain.row(c).transpose();
    beside[c] = 0.0;
    Eigen::Index source = 0;
    if (beside.cwiseAbs().maxCoeff(&source) == 0.0) continue;
    cell.effects.set("ft_crosstalk", name, "source", static_cast<double>(source));
    cell.effects.set("ft_crosstalk", name, "gain", beside[source]);
  }
}

}  // namespace kr5::physics
