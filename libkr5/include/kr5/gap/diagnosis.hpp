// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/core/fields.hpp>
#include <kr5/uncertainty/confidence.hpp>

/// @file
/// Why a simulation and a cell disagree: format `kr5-gap/1`.

namespace kr5::gap {

enum class Verdict {
  NoGap,            ///< The nominal cell explains the recording.
  Explained,        ///< The causes explain it, nothing structured is left.
  PartlyExplained,  ///< A cause is found and a structured gap remains.
  Unknown,          ///< A gap stands above the floor and no catalogued effect explains it.
};
constexpr auto enum_names(Verdict) {
  using enum Verdict;
  return names<Verdict>(
      {{NoGap, "no_gap"}, {Explained, "explained"}, {PartlyExplained, "partly_explained"}, {Unknown, "unknown"}});
}

/// A tested dependence of a residual on what the cell was doing.
struct Dependence {
  std::string variable;
  std::string how;
  double evidence = 0.0;
  double share = 0.0;

  static void each_field(auto& self, auto&& visit) {
    visit("variable", self.variable,
          "Variable it depends on: a column, a rate (qd3), an acceleration (qdd3), or the prediction.");
    visit("how", self.how, "Kind of dependence, in words.");
    visit("evidence", self.evidence, "Probability that the dependence is real, corrected for the number of tests.");
    visit("share", self.share, "Fraction of the structured excess that this variable alone describes.");
  }
};

/// The gap of one column, over all check experiments of a kind (over all, where none is to check).
struct ColumnExcess {
  std::string experiment;
  std::string column;
  std::string target;
  double gap = 0.0;
  double share = 0.0;
  std::vector<Dependence> depends_on;

  static void each_field(auto& self, auto&& visit) {
    visit("experiment", self.experiment, "Kind of experiment.");
    visit("column", self.column, "Column.");
    visit("target", self.target, "Target of the catalogue nearest to the column.");
    visit("gap", self.gap, "RMS of recorded minus simulated over the noise; 1 is the floor.");
    visit("share", self.share, "Fraction of the excess (gap^2 - 1) of all columns.");
    visit("depends_on", self.depends_on, "Variables that the residual depends on, strongest first.");
  }
};

/// A parameter as the cell would hold it.
struct ParameterEstimate {
  std::string name;
  std::vector<double> value;  ///< One number, a vector, or the 16 numbers of a 4x4 matrix row by row.
  std::vector<double> std;    ///< Of each number; of a pose x y z [m] and rotation vector [rad].
  std::string unit;

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name in the catalogue.");
    visit("value", self.value, "Value: a number, a vector, or a 4x4 matrix row by row.");
    visit("std", self.std, "Standard deviation of each number; of a pose x y z [m] and rotation vector [rad].");
    visit("unit", self.unit, "Unit.");
  }
};

struct EffectName {
  std::string effect;
  std::string target;

  friend bool operator==(const EffectName&, const EffectName&) = default;
  static void each_field(auto& self, auto&& visit) {
    visit("effect", self.effect, "Id in the catalogue.");
    visit("target", self.target, "Target of the effect.");
  }
};

/// An effect that is blamed.
struct Cause {
  std::string effect;
  std::string target;
  double probability = 0.0;
  std::vector<ParameterEstimate> parameters;
  double explained_fraction = 0.0;
  std::vector<EffectName> tied_with;

  static void each_field(auto& self, auto&& visit) {
    visit("effect", self.effect, "Id in the catalogue.");
    visit("target", self.target, "Target of the effect.");
    visit("probability", self.probability, "Probability that the cell carries this effect on this target.");
    visit("parameters", self.parameters, "Parameters in absolute values, as in a cell file.");
    visit("explained_fraction", self.explained_fraction,
          "Fraction of the excess that this effect explains beyond the other causes.");
    visit("tied_with", self.tied_with, "Effects that this recording cannot distinguish from it.");
  }
};

struct ColumnReduction {
  std::string column;
  double before = 0.0;
  double after = 0.0;

  static void each_field(auto& self, auto&& visit) {
    visit("column", self.column, "Kind of experiment and column, e.g. motion.i3.");
    visit("before", self.before, "Gap at the nominal cell.");
    visit("after", self.after, "Gap with the causes.");
  }
};

/// Reduction of the gap by the causes, over the columns that stand above the floor before.
struct GapReduction {
  double before = 1.0;
  double after = 1.0;
  double floor = 1.0;
  uncertainty::Interval before_ci, after_ci;
  std::vector<ColumnReduction> columns;

  static void each_field(auto& self, auto&& visit) {
    visit("before", self.before, "RMS gap at the nominal cell.");
    visit("after", self.after, "RMS gap with the causes, over the same columns.");
    visit("floor", self.floor, "Gap of noise alone.");
    visit("before_ci", self.before_ci, "95 % interval of `before`, from resampled pieces of the recording.");
    visit("after_ci", self.after_ci, "95 % interval of `after`.");
    visit("columns", self.columns, "Gap of each column before and after.");
  }
};

/// An effect that is not blamed, although it comes near.
struct NearestEffect {
  std::string effect;
  std::string target;
  double gap = 0.0;
  std::string reason;

  static void each_field(auto& self, auto&& visit) {
    visit("effect", self.effect, "Id in the catalogue.");
    visit("target", self.target, "Target of the effect.");
    visit("gap", self.gap, "Gap that it leaves beside the causes, over the columns above the floor [-].");
    visit("reason", self.reason, "Why it is not blamed.");
  }
};

/// An effect of the catalogue that this cell or recording cannot show.
struct UntriedEffect {
  std::string effect;
  std::vector<std::string> targets;
  std::string reason;

  static void each_field(auto& self, auto&& visit) {
    visit("effect", self.effect, "Id in the catalogue.");
    visit("targets", self.targets, "Targets on which it was not tried; empty: on none.");
    visit("reason", self.reason, "What is missing.");
  }
};

/// Experiment that would distinguish tied effects.
struct NextExperiment {
  std::vector<std::string> separates;
  std::string what;

  static void each_field(auto& self, auto&& visit) {
    visit("separates", self.separates, "Effects to be distinguished, with their targets.");
    visit("do", self.what, "Experiment in words; empty when nothing is tied.");
  }
};

struct Diagnosis {
  Verdict verdict = Verdict::NoGap;
  std::vector<ColumnExcess> where;
  std::vector<Cause> causes;
  std::vector<ColumnExcess> unexplained;
  GapReduction reduction;
  NextExperiment next_experiment;
  std::vector<NearestEffect> nearest;
  std::vector<UntriedEffect> not_tried;
  double scatter = 0.0;
  std::vector<std::string> scope;
  std::vector<std::string> warnings;
  double seconds_screening = 0.0;
  double seconds = 0.0;
  cell::Cell cell;  ///< The nominal cell with the causes added.

  static void each_field(auto& self, auto&& visit) {
    visit("verdict", self.verdict, "Verdict: no_gap | explained | partly_explained | unknown.");
    visit("where", self.where, "Columns above the floor at the nominal cell, largest share first.");
    visit("causes", self.causes, "Effects that are blamed, most probable first.");
    visit("unexplained", self.unexplained, "Columns whose residuals still have structure with the causes.");
    visit("reduction", self.reduction, "Reduction of the gap by the causes.");
    visit("next_experiment", self.next_experiment, "Experiment that would distinguish tied effects.");
    visit("nearest", self.nearest,
          "Effects that come nearest to explaining what remains, where something does; smallest gap first.");
    visit("not_tried", self.not_tried, "Effects of the catalogue that were not tried, and why.");
    visit("scatter", self.scatter,
          "Estimated relative error of the nominal masses, torque constants and (twice that) friction; not a cause.");
    visit("scope", self.scope, "Limits of what the recording can show, within which the verdict holds; empty: none.");
    visit("warnings", self.warnings,
          "Warnings of noise that differs from the declared one, of spikes, and of parts that could not be compared.");
    visit("seconds_screening", self.seconds_screening, "Computing time of the screening [s].");
    visit("seconds", self.seconds, "Total computing time [s].");
  }
};

/// The JSON text of format `kr5-gap/1`.
std::string to_json(const Diagnosis& diagnosis);

}  // namespace kr5::gap
