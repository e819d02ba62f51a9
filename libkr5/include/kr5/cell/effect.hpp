// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <kr5/cell/effects.hpp>
#include <kr5/core/fields.hpp>

/// @file
/// The catalogue of effects: what a cell may carry that its nominal model lacks, by name.

namespace kr5::io {
struct Table;
}

namespace kr5::cell {

struct Cell;
struct Experiment;

/// Target of an effect. There are several joints, motors and wrench components, and one of each other kind.
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

/// Target of an effect in one cell, with the facts about the recording that is searched for it: all that a row of
/// the catalogue may ask.
struct EffectSite {
  const Cell& cell;
  int index = 0;            ///< Joint, motor or wrench component, from 0; 0 for other targets.
  int choice = 0;           ///< Value of the parameter that is a choice.
  double first_time = 0.0;  ///< Earliest time of the recording, 0 at most [s].
  double last_time = 1.0;   ///< Latest time of the recording [s].

  /// Length of the recording, at least 1 s [s].
  double duration() const;
};

/// How a parameter follows from search coordinates x: numbers without unit, 0 where the effect is off, about 1 at a
/// size that such an effect often has.
enum class CoordinateKind {
  None,         ///< No coordinate: the parameter is not searched.
  Linear,       ///< off + size x, for each component.
  Ratio,        ///< off exp(size x), of something positive.
  Reciprocal,   ///< 1 / (size x), off at x = 0.
  WholeCycles,  ///< off + size round(x).
  Logarithmic,  ///< exp(x): a shape, such as a time constant.
  Quotient,     ///< size x / x_first: the product with the first parameter is linear in x.
  Mount,        ///< The nominal pose times a translation and a rotation vector, three coordinates each.
  Amplitude,    ///< size |x|, x the coefficients of sine and cosine.
  Phase,        ///< Angle of these coefficients; no coordinate of its own.
  Cycles,       ///< Periods a turn, taken from the data; no coordinate.
  Choice,       ///< One of a few whole numbers, each a hypothesis of its own; no coordinate.
};
constexpr auto enum_names(CoordinateKind) {
  using enum CoordinateKind;
  return names<CoordinateKind>({{None, "none"},
                                {Linear, "linear"},
                                {Ratio, "ratio"},
                                {Reciprocal, "reciprocal"},
                                {WholeCycles, "whole_cycles"},
                                {Logarithmic, "logarithmic"},
                                {Quotient, "quotient"},
                                {Mount, "mount"},
                                {Amplitude, "amplitude"},
                                {Phase, "phase"},
                                {Cycles, "cycles"},
                                {Choice, "choice"}});
}

/// One value that a parameter of kind `Choice` may take, in words.
struct EffectChoice {
  int value = 0;
  std::string text;
};

/// Least and greatest value.
struct ValueRange {
  double lower = 0.0;
  double upper = 0.0;
};

struct EffectParameter {
  std::string name = {};
  EffectValueKind kind = EffectValueKind::Number;
  std::string unit = {};
  bool nominal_when_off = false;  ///< Off means: as in the cell; the value replaces it.
  std::vector<double> off = {};   ///< Off value otherwise: one number, or one a component.
  double lower = 0.0;
  double upper = 0.0;
  bool required = true;           ///< Must be given when the effect is.
  bool with_and_without = false;  ///< The effect is tried with it and without it, as two hypotheses.
  std::string description = {};
  CoordinateKind coordinate = CoordinateKind::Linear;

  /// Nominal value, where off means: as in the cell. May be empty in a cell that has none.
  std::function<std::optional<EffectValue>(const EffectSite&)> nominal = {};
  /// Change that such an effect often makes: of the parameter, or of its logarithm (`Ratio`), or of its inverse
  /// (`Reciprocal`). Of a mount the translation [m]; its rotation is of the same number in rad.
  std::function<double(const EffectSite&)> size = {};
  /// Range in which the parameter is searched, where it is narrower than from `lower` to `upper`.
  std::function<ValueRange(const EffectSite&)> range = {};
  /// Where the signature of the effect is taken: values of x, or of the parameter itself (`Logarithmic`, `Quotient`).
  /// Empty: where its kind of coordinate usually is.
  std::function<std::vector<double>(const EffectSite&)> signature_at = {};
  /// Values of a parameter of kind `Choice`.
  std::function<std::vector<EffectChoice>(const EffectSite&)> choices = {};
  /// For a whole number that counts targets of a kind from 0: that kind. A file may name the target instead.
  std::optional<EffectTarget> refers_to = {};
  double usual_size = 0.0;  ///< The same as `size` where it is one everywhere; 0: not given.
  double step = 0.02;       ///< Of finite differences, in x [-].

  /// Whether the parameter alone determines the size of the effect; a time constant or a phase does not.
  bool measures_size() const;

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name in the file.");
    visit("kind", self.kind, "Form of the value: number | whole | vector2 | vector3 | pose.");
    visit("unit", self.unit, "Unit; for a prismatic joint read N for N m and m for rad.");
    visit("nominal_when_off", self.nominal_when_off, "Whether the value replaces a value of the cell.");
    visit("off", self.off, "Value that switches the effect off, when it does not replace a value of the cell.");
    visit("lower", self.lower, "Smallest plausible value, of each component.");
    visit("upper", self.upper, "Largest plausible value, of each component.");
    visit("required", self.required, "Whether the parameter is required when the effect is active.");
    visit("with_and_without", self.with_and_without,
          "Whether the effect is tried with and without this parameter, as two hypotheses.");
    visit("description", self.description, "Meaning of the parameter.");
    visit("coordinate", self.coordinate, "Relation of the parameter to the coordinates of a search.");
    visit("usual_size", self.usual_size,
          "Typical change by such an effect, in the unit of the parameter; 0 where it depends on the cell.");
  }
};

/// An effect that is on, with all its parameters that are not off.
struct ActiveEffect {
  std::string id;
  std::string target;
  int index = 0;  ///< Joint, motor or wrench component, from 0; 0 for other targets.
  std::vector<std::pair<std::string, EffectValue>> parameters;

  /// Value of a parameter that is one number.
  /// @throws InvalidArgument for a parameter that is off as in the cell, or none of the effect.
  double number(const std::string& parameter) const;
};

/// Part of a cell that an effect acts on beside its target.
struct EffectNeed {
  std::string part = {};                        ///< In words: "drives".
  std::function<bool(const Cell&)> there = {};  ///< Empty: nothing is needed.
  /// Whether another part stands in its place, so that a cell lacks nothing without it; empty: none can.
  std::function<bool(const Cell&)> replaced = {};
};

/// Row of the catalogue: everything about an effect except its law.
struct Effect {
  std::string id = {};
  EffectTarget target = EffectTarget::Joint;
  std::string label = {};
  std::string description = {};
  std::string shows_in = {};
  bool moves_tool = false;  ///< Where the tool is, in everything that depends on that.
  std::string remedy = {};
  std::vector<EffectParameter> parameters = {};
  double inaccuracy = 0.0;
  bool one_at_a_time = false;
  bool proven_by_poses = false;
  bool in_every_arm = false;
  /// Laws of an effect that was registered: what it changes in the cell that is simulated, and in the predicted columns
  /// (a row for each row of the experiment). Called from any thread. Those of the library stand in kr5/physics.
  std::function<void(Cell&, const ActiveEffect&)> change_cell = {};
  std::function<void(io::Table&, const Experiment&, const ActiveEffect&)> change_columns = {};
  EffectNeed needs = {};

  /// Whether it is periodic in the angle of its joint, with a number of cycles that is estimated from the data.
  bool periodic() const;

  static void each_field(auto& self, auto&& visit) {
    visit("id", self.id, "Name in the file.");
    visit("target", self.target, "Part of the cell that carries the effect.");
    visit("label", self.label, "Short name for reports.");
    visit("description", self.description, "Difference from the nominal cell, in a few words.");
    visit("shows_in", self.shows_in, "Columns in which the effect shows, and its form.");
    visit("moves_tool", self.moves_tool, "Whether it changes where the tool is, in poses, views and scans alike.");
    visit("remedy", self.remedy, "Advice for the real cell.");
    visit("parameters", self.parameters, "Parameters.");
    visit("inaccuracy", self.inaccuracy,
          "Assumed relative error of a simulation of this effect, beyond that of the simulator itself [-].");
    visit("one_at_a_time", self.one_at_a_time, "Whether each parameter is a hypothesis of its own.");
    visit(
        "proven_by_poses", self.proven_by_poses,
        "Whether it changes lengths or angles of links, which every taught pose proves: a less probable cause where a "
        "recording shows loads alone.");
    visit("in_every_arm", self.in_every_arm,
          "Whether every arm has it, so that a cell that states 0 for all joints has left it out: a more probable "
          "cause.");
  }
};

/// All rows of the catalogue.
std::vector<Effect> effect_catalogue();
/// @throws InvalidArgument naming the nearest effect.
const Effect& find_effect(const std::string& id);

/// Value of the cell for a parameter: its nominal value where the effect replaces it, or the value other than 0 that
/// switches the effect off; nothing for an addition, and where the cell does not state it.
/// @param choice Value of the effect's parameter that is a choice.
/// @throws InvalidArgument for an unknown effect, target or parameter, naming what there is.
std::optional<EffectValue> nominal_value(const Cell& cell, const std::string& id, const std::string& target,
                                         const std::string& parameter, int choice = 0);

/// Names of the targets an effect may sit on in this cell: `joint1`..., `fx`..., `camera`...; empty when the cell has
/// no such part.
std::vector<std::string> effect_targets(const Effect& effect, const Cell& cell);

/// Whether a cell has the target, and all else that the effect acts on.
bool effect_possible(const Effect& effect, const Cell& cell, const std::string& target);

/// Part without which a cell cannot carry an effect on any target, in words; empty when it has it.
std::string lacking_part(const Effect& effect, const Cell& cell);
/// Whether another part of the cell stands in the place of the one that an effect acts on, as one kind of servo for
/// another: the effect says nothing about this cell.
bool part_replaced(const Effect& effect, const Cell& cell);

/// Value of a parameter; nothing when it is off as in the cell.
/// @throws InvalidArgument for an unknown effect, target or parameter, naming what there is.
std::optional<EffectValue> get_effect(const Effects& effects, const std::string& id, const std::string& target,
                                      const std::string& parameter);
/// Sets a parameter; nothing switches it off. Bounds are `check`'s business, form is this function's.
/// @throws InvalidArgument as above, and for a target this cell does not have or a value of the wrong form.
void set_effect(Cell& cell, const std::string& id, const std::string& target, const std::string& parameter,
                const std::optional<EffectValue>& value);

/// In the order of the catalogue.
std::vector<ActiveEffect> active_effects(const Effects& effects);

}  // namespace kr5::cell
