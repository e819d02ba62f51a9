// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/core/fields.hpp>
#include <kr5/gap/dependence.hpp>
#include <kr5/gap/findings.hpp>
#include <kr5/gap/other_effects.hpp>
#include <kr5/uncertainty/confidence.hpp>

/// @file
/// Why a simulation and a cell disagree, as data: format `kr5-gap/2`. @see sentences.hpp

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

/// An effect that is blamed.
struct Cause : EffectName {
  double probability = 0.0;
  std::vector<ParameterEstimate> parameters = {};
  double explained_fraction = 0.0;
  std::vector<EffectName> tied_with = {};

  static void each_field(auto& self, auto&& visit) {
    EffectName::each_field(self, visit);
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

/// What a diagnosis found.
struct Diagnosis {
  Verdict verdict = Verdict::NoGap;
  std::vector<ColumnExcess> where;
  std::vector<Cause> causes;
  std::vector<ColumnExcess> unexplained;
  GapReduction reduction;
  NextExperiment next_experiment;
  std::vector<NearestEffect> nearest;
  std::vector<UntriedEffect> not_tried;
  double nuisance_std = 0.0;
  std::vector<ScopeLimit> scope;
  std::vector<NoiseRatio> noise;
  std::vector<ClockFault> clock_faults;
  int spikes = 0;
  int outliers = 0;
  std::vector<ColumnName> coarse;
  std::vector<LeftOut> left_out;
  std::vector<MissingSplit> missing_splits;
  std::vector<ColumnError> excused;
  bool clock_reset = false;
  int effects_limit = 0;
  int sets_limit = 0;
  std::vector<std::string> joint_names;
  std::vector<std::string> notes;
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
    visit("nuisance_std", self.nuisance_std,
          "Estimated relative error of the nominal masses, torque constants and (twice that) friction; not a cause.");
    visit("scope", self.scope, "Limits of what the recording can show, within which the verdict holds; empty: none.");
    visit("noise", self.noise,
          "Noise that differs from what the cell declares; gaps are in units of the measured one.");
    visit("clock_faults", self.clock_faults, "Columns that were logged late or early; no effects of the cell.");
    visit("spikes", self.spikes, "Number of samples that were left out as spikes.");
    visit("outliers", self.outliers, "Number of further samples that deviate from the fitted model and were left out.");
    visit("coarse", self.coarse, "Columns that show almost no noise, as with a coarse resolution or a dead sensor.");
    visit("left_out", self.left_out, "What was recorded and not compared.");
    visit("missing_splits", self.missing_splits, "Kinds of experiments with none to fit, or none to check.");
    visit("excused", self.excused, "Columns with a known error of the simulator, which is not blamed on an effect.");
    visit("clock_reset", self.clock_reset, "Whether t is counted from the first row of each kind, not from its epoch.");
    visit("effects_limit", self.effects_limit,
          "Largest number of causes searched for, where as many were found; else 0.");
    visit("sets_limit", self.sets_limit,
          "Number of about equally likely sets of effects that were examined, where there are more; else 0.");
    visit("joint_names", self.joint_names, "Names of the joints in the description of the robot; empty: none.");
    visit("notes", self.notes, "Warnings in words of a file of format kr5-gap/1, which has no fields for them.");
    visit("seconds_screening", self.seconds_screening, "Computing time of the screening [s].");
    visit("seconds", self.seconds, "Total computing time [s].");
  }
};

/// The JSON text of format `kr5-gap/2`: the fields, and beside them the sentences made of them (`text`, `warnings`),
/// which are not read back.
std::string to_json(const Diagnosis& diagnosis);

/// The diagnosis of a JSON text of format `kr5-gap/2`, or `kr5-gap/1`, whose sentences are kept as notes. Keys that a
/// result file has beside it (`version`, `created`, `command`, `input`) are left alone; there is no cell in it.
/// @param source Names the text in errors.
/// @throws IoError with source, line and field for what is no such text.
Diagnosis diagnosis_from_json(const std::string& text, const std::string& source = "diagnosis");

}  // namespace kr5::gap
