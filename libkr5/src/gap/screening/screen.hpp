// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include <kr5/gap/diagnosis.hpp>

#include "gap/fitting/fit.hpp"
#include "gap/screening/periodic.hpp"

/// @file
/// Which effects could explain what a model leaves, judged by their linear signatures: no simulation but the first.

namespace kr5::gap {

/// A candidate at the point its signature suggests.
struct Suggestion {
  Part part;
  double score = 0.0;  ///< Gain of log evidence, linear.
};

/// Two at once.
struct PairSuggestion {
  Part first, second;
  double score = 0.0;
};

/// A hundredth of a usual size, where a fit can start of what no signature speaks for.
Eigen::VectorXd nearly_off(const Hypothesis& hypothesis);

/// A copy shares the candidates, to which each adds its own.
class Screen {
 public:
  using Progress = std::function<void(double fraction)>;

  /// Simulates the signatures of all hypotheses on the fit experiments: what each changes of a cell, that of the
  /// recording or one with other effects, whose residuals are `base`.
  Screen(const ComparisonData& data, std::vector<Hypothesis> hypotheses, const cell::Cell& about,
         const Eigen::VectorXd& base, int threads, const Progress& progress);

  /// All effects, best first, on what `model` leaves; effects and targets that it has are left out.
  std::vector<Suggestion> rank(const FitProblem& problem, const Model& model);
  /// The best pairs on what the nominal cell leaves, best first.
  std::vector<PairSuggestion> rank_pairs(const FitProblem& problem, const Model& empty, std::size_t count) const;

  int effects() const { return effects_; }
  /// Effects that change no column of the fit experiments.
  const std::vector<EffectName>& unseen() const { return unseen_; }
  const std::vector<std::shared_ptr<const Candidate>>& candidates() const { return candidates_; }

 private:
  /// Periodic effects with the cycles that what is left suggests.
  void add_periodic(const ComparisonData& data, const Eigen::VectorXd& left);

  int threads_ = 0;
  int effects_ = 0;  ///< Effects times targets.
  std::vector<EffectName> unseen_;
  std::vector<std::shared_ptr<const Candidate>> candidates_;
  std::shared_ptr<const std::vector<Carrier>> carriers_;  ///< Of the periodic effects.
};

}  // namespace kr5::gap
