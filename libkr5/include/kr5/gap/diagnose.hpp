// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <kr5/cell/recording.hpp>
#include <kr5/cell/simulator.hpp>
#include <kr5/gap/diagnosis.hpp>
#include <kr5/gap/hypotheses.hpp>
#include <kr5/gap/joint_fit.hpp>

namespace kr5::gap {

struct DiagnoseOptions {
  int max_effects = 6;
  int refits = 12;
  int beam = 3;
  double false_alarms = 0.005;
  double simulator_accuracy = 0.02;
  double simulator_floor = 0.05;
  int threads = 0;

  /// Of single columns, beside `simulator_floor` for all: it counts as noise of the column, and twice of it as no
  /// structure. For a real arm: what the best model of it leaves, which no effect of the catalogue need explain.
  std::vector<ColumnError> simulator_errors;
  /// Whether `simulator_errors` were estimated from the recording itself. They then keep effects from being blamed for
  /// them, and a column that stays off by more than twice its noise, and by more than twice `simulator_accuracy` of
  /// what it shows, is unexplained all the same.
  bool errors_of_recording = false;
  /// Columns whose noise is alike in neighbouring rows: it is larger than these show, and says less than independent
  /// values would.
  std::vector<ColumnCorrelation> noise_correlations;
  /// Effects fitted beside each other (joint_fit.hpp), of one number each. Where slopes at the cell of the recording do
  /// not lead to them, the search begins with them: less what does not pay, and with what they do not explain.
  std::vector<FittedEffect> start;
  /// Hypotheses for this diagnosis only; an effect for every place is registered (kr5/cell/effect_registry.hpp).
  std::vector<Hypothesis> own_hypotheses;
  /// Called from any thread, one call at a time, with what is being done and which part of the whole is.
  std::function<void(const std::string& stage, double fraction)> progress;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("max_effects", self.max_effects, "Largest number of effects that are searched for in one cell.");
    visit("refits", self.refits, "Smallest number of screened effects that are refitted through the simulator.");
    visit("beam", self.beam, "Number of the best sets of effects that are extended by one further effect.");
    visit("false_alarms", self.false_alarms,
          "Probability of a false alarm for a recording without gap, over all columns and tests together.");
    visit("simulator_accuracy", self.simulator_accuracy,
          "Assumed relative error of a simulated effect; only what exceeds it counts as structure [-].");
    visit("simulator_floor", self.simulator_floor,
          "Assumed error of the simulator without any effect, in units of noise: for a simulated cell the rounding of "
          "the printed inputs; for a real arm the gap of its best known model, then above 1 [-].");
    visit("threads", self.threads, "Number of threads; 0: one for each core.");
  }
};

/// Compares a recording with what the simulator shows at the recording's cell, tries every effect of the catalogue on
/// every target, alone and together, and reports where the gap lies, what causes it, how far it is reduced and what
/// remains unknown.
///
/// Effects are screened by linear signatures, refitted on the fit experiments through the simulator, and evaluated on
/// the check experiments as far as the uncertainty of the fit reaches; thresholds are those of tests at `false_alarms`.
/// A structure is what such a test finds in a column, or an effect whose size is not the same in all experiments,
/// columns, postures, speeds and times. Probabilities are those of the fitted sets of effects (Laplace), lowered by the
/// structure that an effect leaves: not at all when that is no more than the simulator may be off, to nothing when it
/// is a twentieth of what the effect explains; an effect that is less than evenly trusted is not blamed. Columns that
/// are logged late or early compete with effects, and are warned of. @see diagnosis.hpp
/// @throws InvalidArgument for a recording without anything to compare.
Diagnosis diagnose(const cell::Recording& recording, const cell::Simulator& simulator,
                   const DiagnoseOptions& options = {});

/// The same of effects that were chosen before: `options.start` is fitted once more, and is the causes. No other effect
/// is tried, and none is taken away. For real arms, of which no model leaves noise alone.
/// @throws InvalidArgument for a recording without anything to compare, and without a start.
Diagnosis diagnose_start(const cell::Recording& recording, const cell::Simulator& simulator,
                         const DiagnoseOptions& options);

}  // namespace kr5::gap
