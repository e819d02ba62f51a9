// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/cell/recording.hpp>
#include <kr5/cell/simulator.hpp>
#include <kr5/gap/diagnosis.hpp>
#include <kr5/gap/measure.hpp>

/// @file
/// Fits of single effects to a recording, and its residuals row by row: for explanations. A diagnosis weighs all
/// effects against each other. @see diagnose.hpp

namespace kr5::gap {

/// Noise that is not what the cell of a recording declares, as a diagnosis warns of it.
struct NoiseOverride {
  std::string key;
  std::optional<cell::Kind> kind = {};
  double ratio = 1.0;  ///< [-]

  /// @throws InvalidArgument for a ratio that is not positive, or a key that a cell has not.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("key", self.key, "Key in `noise` of the cell, e.g. current.");
    visit("kind", self.kind, "Kind of experiment to which it applies; without: all.");
    visit("ratio", self.ratio, "Ratio of measured to declared noise [-].");
  }
};

/// One column of one experiment, row by row.
struct ResidualColumn {
  std::string experiment;
  std::string column;
  double noise = 0.0;
  Eigen::MatrixXd residuals;

  static void each_field(auto& self, auto&& visit) {
    visit("experiment", self.experiment, "Name of the experiment.");
    visit("column", self.column, "Name of the column; orientation is rx ry rz, of Log(R_simulated^T R_recorded).");
    visit("noise", self.noise, "Standard deviation of one sample, in the unit of the column.");
    visit("residuals", self.residuals,
          "Recorded minus simulated over the noise, a row for each row of the recording [-]: first for the cell of the "
          "recording, then for each given cell. NaN where the two cannot be compared, and for spikes.");
  }
};

/// Residuals of all columns that can be compared, at the recording's own cell and at others, in units of the noise that
/// the recording's cell states. Spikes, stray corners and stray poses are marked as in a diagnosis.
/// @param cells the first is taken as correct: samples that deviate from it, also near edges, count as spikes.
/// @throws InvalidArgument for a cell of another robot, noise that is not valid, and when nothing can be compared.
std::vector<ResidualColumn> residual_columns(const cell::Recording& recording, const cell::Simulator& simulator,
                                             const std::vector<cell::Cell>& cells = {},
                                             const std::vector<NoiseOverride>& noise = {});

/// Where these residuals are: by subsystem, target, channel, experiment, pose region and speed.
/// @param which column of `residuals`.
/// @throws InvalidArgument for residuals of another recording.
std::vector<GapPart> gap_parts(const cell::Recording& recording, const std::vector<ResidualColumn>& columns,
                               int which = 0);

struct EffectFitOptions {
  std::vector<NoiseOverride> noise;
  int threads = 0;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("noise", self.noise, "Noise that differs from what the cell of the recording declares.");
    visit("threads", self.threads, "Number of threads; 0: one for each core.");
  }
};

/// Effect fitted to the fit experiments and evaluated on the check experiments (on all, without any).
struct EffectFit : EffectName {
  std::string choice;
  std::vector<ParameterEstimate> parameters;
  double explained_fraction = 0.0;  ///< [-]
  std::vector<ColumnReduction> columns;

  static void each_field(auto& self, auto&& visit) {
    EffectName::each_field(self, visit);
    visit("choice", self.choice, "Discrete choice (cycles, source, element) in words; empty where there is none.");
    visit("parameters", self.parameters, "Parameters as in a cell file.");
    visit("explained_fraction", self.explained_fraction,
          "Fraction of the excess (gap^2 - 1, of columns above the floor) that it explains [-].");
    visit("columns", self.columns, "Columns that change or are above the floor, largest change first.");
  }
};

/// Fits each of these effects alone to what `cell` leaves; noise is that of the recording's cell. Effects that change
/// nothing that was recorded are left out.
/// @throws InvalidArgument for an effect that is not in the catalogue, and when nothing can be compared.
std::vector<EffectFit> fit_effects(const cell::Recording& recording, const cell::Cell& cell,
                                   const cell::Simulator& simulator, const std::vector<EffectName>& effects,
                                   const EffectFitOptions& options = {});

/// The effects of the catalogue that explain most of what `cell` leaves, `except` these, the best first: screened by
/// their linear signatures, then fitted each alone.
/// @param most so many, at most.
std::vector<EffectFit> fit_best_effects(const cell::Recording& recording, const cell::Cell& cell,
                                        const cell::Simulator& simulator, const std::vector<EffectName>& except,
                                        int most = 3, const EffectFitOptions& options = {});

}  // namespace kr5::gap
