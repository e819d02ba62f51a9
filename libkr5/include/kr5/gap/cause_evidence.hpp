// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <kr5/cell/recording.hpp>
#include <kr5/gap/diagnosis.hpp>
#include <kr5/gap/effect_fit.hpp>

/// @file
/// What the residuals of a recording say for and against one cause of its diagnosis: for explanations.
/// @see explanation.hpp, which asks it of every cause

namespace kr5::gap {

/// RMS of the residuals that are numbers; NaN without any [-].
double residual_gap(const Eigen::VectorXd& residuals);

/// Gap of a column over the experiments that judge it: those to check, all where none is.
struct JudgedColumn {
  std::string column;
  std::vector<std::string> experiments;
  int rows = 0;
  double gap = 0.0;    ///< [-]
  double limit = 0.0;  ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("column", self.column, "Kind of experiment and column, e.g. motion.i3.");
    visit("experiments", self.experiments, "Names of the experiments that judge it.");
    visit("rows", self.rows, "Number of compared rows.");
    visit("gap", self.gap, "RMS of their residuals; NaN without any [-].");
    visit("limit", self.limit, "Gap that noise alone exceeds once in a thousand columns [-].");
  }
};

/// The columns of a recording, in its order.
/// @param columns Of residual_columns. @param which Column of `residuals`.
/// @throws InvalidArgument for residuals of another recording.
std::vector<JudgedColumn> judged_columns(const cell::Recording& recording, const std::vector<ResidualColumn>& columns,
                                         int which = 0);

/// What a cause explains of a column, on the experiments that judge it.
struct ColumnEvidence {
  std::string column;
  double without = 0.0;   ///< [-]
  double with_all = 0.0;  ///< [-]
  double limit = 0.0;     ///< [-]
  double share = 0.0;     ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("column", self.column, "Kind of experiment and column, e.g. motion.i3.");
    visit("without", self.without, "Gap with the other causes alone [-].");
    visit("with_all", self.with_all, "Gap with all causes [-].");
    visit("limit", self.limit, "Gap that noise alone exceeds once in a thousand columns [-].");
    visit("share", self.share,
          "Fraction of all squares of residuals that the cause takes away; negative where it adds some [-].");
  }
};

/// What a cause explains of an experiment.
struct ExperimentEvidence {
  std::string experiment;
  double closed = 0.0;  ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("experiment", self.experiment, "Name of the experiment.");
    visit("closed", self.closed,
          "Fraction that the cause closes of the excess (gap^2 - 1) of the columns that exceed their limit without it "
          "[-].");
  }
};

struct CauseEvidence {
  std::vector<ColumnEvidence> columns;
  std::vector<ExperimentEvidence> experiments;
  std::optional<double> deviations = {};  ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("columns", self.columns, "Columns, the one of which it explains most first.");
    visit("experiments", self.experiments, "Experiments in which a column exceeds its limit without the cause.");
    visit("deviations", self.deviations,
          "Standard deviations by which its size differs from that at which it is off; none where they are not known "
          "[-].");
  }
};

/// Without `deviations`, which are no matter of residuals.
/// @param columns Of residual_columns. @param without Column of `residuals` at the cell with the other causes alone.
/// @param with_all The same with all causes.
/// @throws InvalidArgument for residuals of another recording.
CauseEvidence cause_evidence(const cell::Recording& recording, const std::vector<ResidualColumn>& columns, int without,
                             int with_all);

/// By how many standard deviations the best known number that tells the size of an effect differs from the value at
/// which the effect is off [-]; nothing where none is known.
/// @param cell Without the effect.
/// @throws InvalidArgument for an effect, target or parameter that is not in the catalogue.
std::optional<double> deviations_from_off(const cell::Cell& cell, const EffectName& effect,
                                          const std::vector<ParameterEstimate>& parameters);

}  // namespace kr5::gap
