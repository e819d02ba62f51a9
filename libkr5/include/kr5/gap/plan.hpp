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
/// What a recording cannot tell apart, and the experiment that would.

namespace kr5::gap {

/// One of the explanations that are to be told apart: effects that act together.
using Alternative = std::vector<EffectName>;

struct PlanOptions {
  double separation = 5.0;
  double speed = 0.7;
  double load = 0.0;
  double wait = 1800.0;
  double scatter = 0.004;
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
    visit("separation", self.separation, "Separation that is wanted, in standard deviations [-].");
    visit("speed", self.speed, "Part of the speed limits that motions may use [-].");
    visit("load", self.load, "Known weight that may be hung on the tool, at its centre of mass; 0: none [kg].");
    visit("wait", self.wait, "Longest time one is ready to wait, the cell kept moving, before an experiment [s].");
    visit("scatter", self.scatter, "What masses, torque constants and (twice that) friction may be off besides [-].");
    visit("simulator_accuracy", self.simulator_accuracy, "What a simulated effect may be off, of its own size [-].");
    visit("keep", self.keep, "So many of the best experiments are returned.");
    visit("threads", self.threads, "Threads; 0: one a core.");
    visit("seed", self.seed, "Of random postures and motions.");
  }
};

/// What one column would show under each alternative.
struct ForecastColumn {
  std::string column;
  std::vector<double> change;  ///< One an alternative.
  double difference = 0.0;

  static void each_field(auto& self, auto&& visit) {
    visit("column", self.column, "Column; orientation is rx ry rz.");
    visit("change", self.change, "RMS by which each alternative moves it from the nominal cell, over the noise [-].");
    visit("difference", self.difference, "Largest RMS between two alternatives, over the noise [-].");
  }
};

/// An experiment that could be done, and what it would tell.
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
    visit("what", self.what, "The experiment in words.");
    visit("load", self.load, "Known weight on the tool, at its centre of mass [kg].");
    visit("seconds", self.seconds, "Time it takes, set-up and waiting included [s].");
    visit("separation", self.separation, "Expected, between the two alternatives that are hardest to tell apart [-].");
    visit("log_bayes", self.log_bayes, "Expected logarithm of the odds it brings: half the square of the separation.");
    visit("repeats", self.repeats, "So many of it (100 at most) reach the separation that is wanted.");
    visit("separation_repeated", self.separation_repeated, "Separation after these repeats [-].");
    visit("wrong", self.wrong, "Probability that the likelier alternative is the wrong one after these repeats.");
    visit("columns", self.columns, "What the columns would show, largest difference first.");
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
    visit("alternatives", self.alternatives, "What is to be told apart.");
    visit("assumed", self.assumed, "The recording shows none of them: a size they often have is assumed.");
    visit("already", self.already, "Separation that the recording itself has [-].");
    visit("exact_tie", self.exact_tie,
          "No experiment of the family tells them apart by two standard deviations, not even if done 100 times.");
    visit("text", self.text, "In words.");
    visit("experiments", self.experiments, "Best first: the clearest of those that reach the separation soonest.");
  }
};

/// The experiment that tells explanations of a recording apart, computed from their signatures.
///
/// One alternative is fitted to the recording and the others to what the cell would have recorded with it, so that all
/// look alike. A family of experiments is then simulated: motions of one joint and of all, slow and fast, small and
/// wide, from other postures, with a known weight, after waiting; spread, near, far and single-joint postures; views,
/// scans, steps, presses and profiles other than those recorded. Each is scored by the least sum of squares, in noise,
/// that stays between two alternatives when the wrong one adapts its parameters (as far as the recording leaves them
/// open), the nominal parameters scatter, and the simulator is off: its root is the separation, half of it the expected
/// log Bayes factor. The best are confirmed by fitting through the simulator.
///
/// Motions stay within the joint limits, a part of the speed limits, above the lowest point of the recorded ones, and
/// within the effort limits or, where a cell states none, twice the currents recorded. Collisions are not known here.
/// Kinds of experiments that were not recorded are tried when those recorded do not suffice.
/// @throws InvalidArgument for fewer than two alternatives, or an effect that the cell cannot have.
Plan plan(const cell::Recording& recording, const cell::Simulator& simulator,
          const std::vector<Alternative>& alternatives, const PlanOptions& options = {});

/// Which of several explanations recordings of one cell support.
struct Weighed {
  int best = 0;
  std::vector<double> log_evidence;
  std::vector<double> probability;

  static void each_field(auto& self, auto&& visit) {
    visit("best", self.best, "The likeliest alternative, from 0.");
    visit("log_evidence", self.log_evidence, "Of each alternative, fitted to all recordings (Laplace).");
    visit("probability", self.probability, "Of each among these, equally likely beforehand.");
  }
};

/// Fits each alternative to all recordings together. Their cells may differ in the tool (a known weight hung on it).
/// @throws InvalidArgument as `plan` does.
Weighed weigh(const std::vector<cell::Recording>& recordings, const cell::Simulator& simulator,
              const std::vector<Alternative>& alternatives, const PlanOptions& options = {});

/// The cell with a known weight on the tool: a point mass [kg] at the tool's centre of mass.
/// @throws InvalidArgument for a cell without tool, or a negative mass.
cell::Cell with_load(const cell::Cell& cell, double mass);

}  // namespace kr5::gap
