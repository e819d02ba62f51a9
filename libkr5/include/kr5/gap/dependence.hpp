// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include <kr5/core/fields.hpp>
#include <kr5/gap/effect_name.hpp>

/// @file
/// What a residual depends on, and how: as data. Sentences are made of it in sentences.hpp.

namespace kr5::gap {

enum class VariableKind {
  None,               ///< Nothing.
  Column,             ///< A column of the recording.
  JointPosition,      ///< Commanded, where it is recorded, else measured.
  JointVelocity,      ///< Its rate.
  JointSpeed,         ///< Absolute value of the rate.
  JointAcceleration,  ///< Rate of the rate.
  PathVelocity,       ///< Rate of the commanded height of the path correction.
  Prediction,         ///< What the simulator predicts for a column.
  Experiment,         ///< Which experiment it is.
  ExperimentKind,     ///< Of which kind that is.
  WhichColumn,        ///< Which column it is.
};
constexpr auto enum_names(VariableKind) {
  using enum VariableKind;
  return names<VariableKind>({{None, "none"},
                              {Column, "column"},
                              {JointPosition, "joint_position"},
                              {JointVelocity, "joint_velocity"},
                              {JointSpeed, "joint_speed"},
                              {JointAcceleration, "joint_acceleration"},
                              {PathVelocity, "path_velocity"},
                              {Prediction, "prediction"},
                              {Experiment, "experiment"},
                              {ExperimentKind, "experiment_kind"},
                              {WhichColumn, "which_column"}});
}

/// What the cell was doing, as a number in each row.
struct Variable {
  VariableKind kind = VariableKind::None;
  int joint = 0;  ///< From 1, as in `joint3`.
  std::string column = {};
  std::string experiment = {};

  friend bool operator==(const Variable&, const Variable&) = default;
  static void each_field(auto& self, auto&& visit) {
    visit("kind", self.kind,
          "Kind: none | column | joint_position | joint_velocity | joint_speed | joint_acceleration | path_velocity | "
          "prediction | experiment | experiment_kind | which_column.");
    visit("joint", self.joint, "Number of the joint, from 1; 0: of none.");
    visit("column", self.column, "Column; empty: of none.");
    visit("experiment", self.experiment,
          "Kind of experiment in which it is taken; empty: that of the column whose residual depends on it.");
  }
};

/// Short notation, for tables and plots: `q3`, `qd3`, `|qd3|`, `qdd3`, `zcd`, `predicted i3`, the name of a column.
std::string symbol(const Variable& variable);
/// The variable of such a notation; of any other text the column that is called so.
Variable find_variable(const std::string& symbol);

/// How a residual depends on a variable.
enum class Shape {
  Offset,         ///< The same everywhere.
  Below,          ///< Largest below `upper`.
  Above,          ///< Largest above `lower`.
  Between,        ///< Largest between the two.
  Grows,          ///< With the variable.
  Falls,          ///< With the variable.
  Varies,         ///< In another way.
  Drifts,         ///< Slowly, over `samples` and more.
  Oscillates,     ///< With the `period`.
  EffectDiffers,  ///< The size of `effect` is not the same everywhere.
  Described,      ///< In words of an older file, `note`.
};
constexpr auto enum_names(Shape) {
  using enum Shape;
  return names<Shape>({{Offset, "offset"},
                       {Below, "below"},
                       {Above, "above"},
                       {Between, "between"},
                       {Grows, "grows"},
                       {Falls, "falls"},
                       {Varies, "varies"},
                       {Drifts, "drifts"},
                       {Oscillates, "oscillates"},
                       {EffectDiffers, "effect_differs"},
                       {Described, "described"}});
}

/// A tested dependence of a residual on what the cell was doing.
struct Dependence {
  Variable variable = {};
  Shape shape = Shape::Varies;
  int sign_joint = 0;                            ///< From 1.
  std::optional<double> lower = {}, upper = {};  ///< [unit]
  std::string unit = {};
  double period = 0.0;  ///< [s]
  int samples = 0;
  EffectName effect = {};
  double evidence = 0.0;
  double share = 0.0;
  std::string note = {};

  static void each_field(auto& self, auto&& visit) {
    visit("variable", self.variable, "Variable that it depends on.");
    visit("shape", self.shape,
          "Shape: offset | below | above | between | grows | falls | varies | drifts | oscillates | effect_differs | "
          "described.");
    visit("sign_joint", self.sign_joint,
          "Number of the joint with whose direction of motion the residual changes sign, from 1; 0: of none.");
    visit("lower", self.lower, "Lower end of the range in which the residual is largest [unit].");
    visit("upper", self.upper, "Upper end of that range [unit].");
    visit("unit", self.unit, "Unit of the variable.");
    visit("period", self.period, "Period of an oscillation [s].");
    visit("samples", self.samples, "Number of samples over which a drift lasts at least.");
    visit("effect", self.effect, "Effect whose size differs with the variable.");
    visit("evidence", self.evidence, "Probability that the dependence is real, corrected for the number of tests.");
    visit("share", self.share, "Fraction of the structured excess that this variable alone describes.");
    visit("note", self.note, "Words of a file of format kr5-gap/1, which has no more than these.");
  }
};

}  // namespace kr5::gap
