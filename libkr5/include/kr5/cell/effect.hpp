// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <variant>
#include <vector>

#include <kr5/cell/effects.hpp>
#include <kr5/core/fields.hpp>

/// @file
/// The catalogue of effects: what a cell may carry that its nominal model lacks, by name.

namespace kr5::cell {

struct Cell;

/// What an effect sits on. Joints, motors and wrench components are many, the others one.
enum class EffectTarget {
  Joint,
  Motor,
  WrenchComponent,
  Tool,
  Base,
  Links,
  Drives,
  Servo,
  ForceTorque,
  Camera,
  Laser,
  Contact,
  Gripper,
  Tube
};
constexpr auto enum_names(EffectTarget) {
  using enum EffectTarget;
  return names<EffectTarget>({{Joint, "joint"},
                              {Motor, "motor"},
                              {WrenchComponent, "wrench_component"},
                              {Tool, "tool"},
                              {Base, "base"},
                              {Links, "links"},
                              {Drives, "drives"},
                              {Servo, "servo"},
                              {ForceTorque, "force_torque"},
                              {Camera, "camera"},
                              {Laser, "laser"},
                              {Contact, "contact"},
                              {Gripper, "gripper"},
                              {Tube, "tube"}});
}

enum class EffectValueKind {
  Number,
  Whole,  ///< A whole number.
  Vector2,
  Vector3,
  Pose,
};
constexpr auto enum_names(EffectValueKind) {
  using enum EffectValueKind;
  return names<EffectValueKind>(
      {{Number, "number"}, {Whole, "whole"}, {Vector2, "vector2"}, {Vector3, "vector3"}, {Pose, "pose"}});
}

/// A number (or whole number), a vector, or a pose.
using EffectValue = std::variant<double, Eigen::VectorXd, Pose>;

struct EffectParameter {
  std::string name;
  EffectValueKind kind = EffectValueKind::Number;
  std::string unit;
  bool nominal_when_off = false;  ///< Off means: as in the cell; the value replaces it.
  std::vector<double> off;        ///< Off value otherwise: one number, or one a component.
  double lower = 0.0;
  double upper = 0.0;
  bool required = true;  ///< Must be given when the effect is.
  std::string description;

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name in the file.");
    visit("kind", self.kind, "number | whole | vector2 | vector3 | pose.");
    visit("unit", self.unit, "Unit; for a prismatic joint read N for N m and m for rad.");
    visit("nominal_when_off", self.nominal_when_off, "Off means: as in the cell; the value replaces it.");
    visit("off", self.off, "Off value, when it is not that of the cell.");
    visit("lower", self.lower, "Least value that makes sense, of each component.");
    visit("upper", self.upper, "Greatest value that makes sense, of each component.");
    visit("required", self.required, "Must be given when the effect is.");
    visit("description", self.description, "What it is.");
  }
};

struct Effect {
  std::string id;
  EffectTarget target = EffectTarget::Joint;
  std::string description;
  std::vector<EffectParameter> parameters;

  static void each_field(auto& self, auto&& visit) {
    visit("id", self.id, "Name in the file.");
    visit("target", self.target, "What it sits on.");
    visit("description", self.description, "What it is.");
    visit("parameters", self.parameters, "Its parameters.");
  }
};

/// All rows of the catalogue.
std::span<const Effect> effect_catalogue();
/// @throws InvalidArgument naming the nearest effect.
const Effect& find_effect(const std::string& id);

/// Names of the targets an effect may sit on in this cell: `joint1`..., `fx`..., `camera`...; empty when the cell has
/// no such part.
std::vector<std::string> effect_targets(const Effect& effect, const Cell& cell);

/// Value of a parameter; nothing when it is off as in the cell.
/// @throws InvalidArgument for an unknown effect, target or parameter, naming what there is.
std::optional<EffectValue> get_effect(const Effects& effects, const std::string& id, const std::string& target,
                                      const std::string& parameter);
/// Sets a parameter; nothing switches it off. Bounds are `check`'s business, form is this function's.
/// @throws InvalidArgument as above, and for a target this cell does not have or a value of the wrong form.
void set_effect(Cell& cell, const std::string& id, const std::string& target, const std::string& parameter,
                const std::optional<EffectValue>& value);

/// An effect that is on, with all its parameters that are not off.
struct ActiveEffect {
  std::string id;
  std::string target;
  std::vector<std::pair<std::string, EffectValue>> parameters;
};
/// In the order of the catalogue.
std::vector<ActiveEffect> active_effects(const Effects& effects);

}  // namespace kr5::cell
