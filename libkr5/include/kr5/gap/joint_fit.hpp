// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/cell/recording.hpp>
#include <kr5/cell/simulator.hpp>
#include <kr5/gap/diagnosis.hpp>

/// @file
/// Effects of all joints at once: friction, gains, inertias. No effect is weighed against another. @see diagnose.hpp

namespace kr5::gap {

struct JointFitOptions {
  std::vector<std::string> effects;
  /// Of the effects those on these targets alone; empty: each on every joint that carries it.
  std::vector<EffectName> only = {};
  /// The cell of the recording with other values of these effects, from which the fit begins; without: those of the
  /// recording's cell.
  std::optional<cell::Cell> from = {};
  /// Whether the fit ends at a step that takes away less than a small part of what is left, since that is no noise: of
  /// a real arm of which no model leaves noise alone.
  bool coarse = false;
  int threads = 0;
  /// Called from any thread, one call at a time, with the part of the whole that is done.
  std::function<void(double fraction)> progress;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("effects", self.effects,
          "Ids of the effects that are fitted, each on every joint that carries it, the most important first.");
    visit("threads", self.threads, "Number of threads; 0: one for each core.");
  }
};

/// One effect on one target, fitted beside all others.
struct FittedEffect : EffectName {
  std::vector<ParameterEstimate> parameters;
  bool determined = false;
  double departure = 0.0;

  static void each_field(auto& self, auto&& visit) {
    EffectName::each_field(self, visit);
    visit("parameters", self.parameters, "Parameters in absolute values, as in a cell file.");
    visit("determined", self.determined,
          "Whether the motions tell it: its uncertainty is below three usual sizes of the effect.");
    visit("departure", self.departure,
          "Distance of the value from that of the model, or from none, in standard deviations [-].");
  }
};

/// How far the predictions of a column are off, in its unit. RMS over the experiments of a use, 0 where there are none.
struct ColumnFit {
  std::string column;
  double noise = 0.0;
  double before = 0.0;
  double after = 0.0;
  double check_before = 0.0;
  double check_after = 0.0;

  static void each_field(auto& self, auto&& visit) {
    visit("column", self.column, "Kind of experiment and column, e.g. motion.q3.");
    visit("noise", self.noise, "Standard deviation of one sample, in the unit of the column.");
    visit("before", self.before, "RMS at the cell of the recording, experiments to fit.");
    visit("after", self.after, "RMS with the fitted effects, experiments to fit.");
    visit("check_before", self.check_before, "RMS at the cell of the recording, experiments to check.");
    visit("check_after", self.check_after, "RMS with the fitted effects, experiments to check.");
  }
};

struct JointFit {
  std::vector<FittedEffect> effects;
  Eigen::MatrixXd covariance;
  std::vector<ColumnFit> columns;
  cell::Cell cell;
  double seconds = 0.0;

  static void each_field(auto& self, auto&& visit) {
    visit("effects", self.effects, "Effects with their values.");
    visit("covariance", self.covariance,
          "Covariance of the first parameter of each effect, in their units, for residuals as correlated as found.");
    visit("columns", self.columns, "How far each column is off before and after.");
    visit("seconds", self.seconds, "Computing time [s].");
  }
};

/// Fits effects of the catalogue to all joints together by the experiments to fit (Levenberg-Marquardt). Covariances
/// count residuals as dependent within two seconds. Effects that the cell cannot carry are left out.
/// @throws InvalidArgument for an effect that is not in the catalogue or has several parameters, and when nothing can
///         be compared.
JointFit fit_joint_effects(const cell::Recording& recording, const cell::Simulator& simulator,
                           const JointFitOptions& options);

}  // namespace kr5::gap
