// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <kr5/cell/recording.hpp>
#include <kr5/cell/simulator.hpp>
#include <kr5/gap/diagnosis.hpp>
#include <kr5/gap/hypotheses.hpp>

/// @file
/// Explanations that a recording cannot distinguish, and the experiment that can.

namespace kr5::gap {

/// One of the explanations to be distinguished: effects that act together.
using Alternative = std::vector<EffectName>;

struct PlanOptions {
  double separation = 5.0;
  double speed = 0.7;
  double load = 0.0;
  double wait = 1800.0;
  double nuisance_std = 0.004;
  double simulator_accuracy = 0.02;
  int keep = 5;
  int threads = 0;
  std::uint64_t seed = 1;

  /// Effects beyond those of the catalogue.
  std::vector<Hypothesis> own_hypotheses;
  /// Called from any thread with what is being done, and which part of it is.
  std::function<void(const std::string& stage, double fraction)> progress;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("separation", self.separation, "Desired separation of the alternatives, in standard deviations [-].");
    visit("speed", self.speed, "Fraction of the speed limits that motions may use [-].");
    visit("load", self.load,
          "Mass of a known weight that may be hung on the tool, at its centre of mass; 0: none [kg].");
    visit("wait", self.wait,
          "Longest acceptable waiting time before an experiment, during which the cell keeps moving [s].");
    visit("nuisance_std", self.nuisance_std,
          "Assumed relative error of the nominal masses, torque constants and (twice that) friction [-].");
    visit("simulator_accuracy", self.simulator_accuracy, "Assumed relative error of a simulated effect [-].");
    visit("keep", self.keep, "Number of experiments that are returned, the best first.");
    visit("threads", self.threads, "Number of threads; 0: one for each core.");
    visit("seed", self.seed, "Random seed of postures and motions.");
  }
};

/// What one column would show under each alternative.
struct ForecastColumn {
  std::string column;
  std::vector<double> change;  ///< One an alternative.
  double difference = 0.0;

  static void each_field(auto& self, auto&& visit) {
    visit("column", self.column, "Column; orientation is rx ry rz.");
    visit("change", self.change, "RMS change against the nominal cell over the noise, one for each alternative [-].");
    visit("difference", self.difference, "Largest RMS difference between two alternatives over the noise [-].");
  }
};

/// Planned experiment with its forecast.
struct PlannedExperiment {
  cell::Experiment experiment;  ///< Its given columns.
  std::string what;
  double load = 0.0;
  double seconds = 0.0;
  double separation = 0.0;
  double log_bayes = 0.0;
  int repeats = 1;
  double separation_repeated = 0.0;
  double wrong = 0.5;
  std::vector<ForecastColumn> columns;

  static void each_field(auto& self, auto&& visit) {
    visit("what", self.what, "Experiment in words.");
    visit("load", self.load, "Mass of the known weight on the tool, at its centre of mass [kg].");
    visit("seconds", self.seconds, "Duration, set-up and waiting included [s].");
    visit("separation", self.separation,
          "Expected separation of the two alternatives that are hardest to distinguish [-].");
    visit("log_bayes", self.log_bayes, "Expected log Bayes factor: half the square of the separation [-].");
    visit("repeats", self.repeats, "Number of repeats (100 at most) that reach the desired separation.");
    visit("separation_repeated", self.separation_repeated, "Separation after these repeats [-].");
    visit("wrong", self.wrong, "Probability that the likelier alternative is the wrong one after these repeats.");
    visit("columns", self.columns, "Forecast of each column, largest difference first.");
  }
};

struct Plan {
  std::vector<Alternative> alternatives;
  bool assumed = false;
  double already = 0.0;
  bool exact_tie = false;
  std::string text;
  std::vector<PlannedExperiment> experiments;
  std::vector<cell::Cell> cells;  ///< The cell of the recording with each alternative, alike in this recording.

  static void each_field(auto& self, auto&& visit) {
    visit("alternatives", self.alternatives, "Alternatives to be distinguished.");
    visit("assumed", self.assumed,
          "Whether the recording shows none of the alternatives, so that usual sizes are assumed.");
    visit("already", self.already, "Separation that the recording itself provides [-].");
    visit("exact_tie", self.exact_tie,
          "Whether no experiment distinguishes them by two standard deviations, even with 100 repeats.");
    visit("text", self.text, "Summary in words.");
    visit("experiments", self.experiments,
          "Experiments, best first: the clearest of those that reach the separation soonest.");
  }
};

/// Plans the experiment that distinguishes explanations of a recording, from their signatures.
///
/// One alternative is fitted to the recording and the others to what the cell would have recorded with it, so that all
/// look alike. A family of experiments is then simulated: motions of one joint and of all, slow and fast, small and
/// wide, from other postures, with a known weight, after waiting; spread, near, far and single-joint postures; views,
/// scans, steps, presses and profiles other than those recorded. Each is scored by the least sum of squares, in noise,
/// that stays between two alternatives when the wrong one adapts its parameters (as far as the recording leaves them
/// open), the nominal parameters are uncertain, and the simulator is off: its root is the separation, half of it the
/// expected log Bayes factor. The best are confirmed by fitting through the simulator.
///
/// Motions stay within the joint limits, a part of the speed limits, above the lowest point of the recorded ones, and
/// within the effort limits or, where a cell states none, twice the currents recorded. Collisions are not known here.
/// Kinds of experiments that were not recorded are tried when those recorded do not suffice.
/// @throws InvalidArgument for fewer than two alternatives, or an effect that the cell cannot have.
Plan plan(const cell::Recording& recording, const cell::Simulator& simulator,
          const std::vector<Alternative>& alternatives, const PlanOptions& options = {});

/// Explanations that a diagnosis could not distinguish, for `plan`: its causes, and the same with each effect that
/// could stand in the place of one. Empty when nothing is tied.
std::vector<Alternative> tied_alternatives(const Diagnosis& diagnosis);

/// Support that recordings of one cell give to each of several explanations.
struct ModelComparison {
  int best = 0;
  std::vector<double> log_evidence;
  std::vector<double> probability;

  static void each_field(auto& self, auto&& visit) {
    visit("best", self.best, "Index of the likeliest alternative, from 0.");
    visit("log_evidence", self.log_evidence, "Log evidence of each alternative, fitted to all recordings (Laplace).");
    visit("probability", self.probability, "Probability of each alternative among these, equally likely beforehand.");
  }
};

/// Fits each alternative to all recordings together. Their cells may differ in the tool (a known weight hung on it).
/// @throws InvalidArgument as `plan` does.
ModelComparison compare_models(const std::vector<cell::Recording>& recordings, const cell::Simulator& simulator,
                               const std::vector<Alternative>& alternatives, const PlanOptions& options = {});

/// The cell with a known weight on the tool: a point mass [kg] at the tool's centre of mass.
/// @throws InvalidArgument for a cell without tool, or a negative mass.
cell::Cell with_load(const cell::Cell& cell, double mass);

}  // namespace kr5::gap
