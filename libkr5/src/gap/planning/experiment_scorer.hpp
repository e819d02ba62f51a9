// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "gap/planning/fit_context.hpp"
#include "gap/planning/proposal.hpp"

/// @file
/// What an experiment that was not done yet would tell.

namespace kr5::gap {

/// How often an experiment may have to be repeated. What the model is off does not average out: the separation grows
/// ever less.
inline constexpr std::array<int, 8> repeats = {1, 2, 3, 5, 10, 20, 50, 100};

struct Score {
  /// Of the two alternatives that are hardest to tell apart, after each number of `repeats`.
  std::array<double, repeats.size()> separation = {};
  std::vector<ForecastColumn> columns;
};

/// What proposals are judged by: alternatives that look alike in what was recorded.
struct ExperimentScorer {
  const ComparisonData& data;
  const std::vector<Fitted>& fitted;
  double nuisance_std = 0.004;
  double accuracy = 0.02;
  Eigen::VectorXd highest_current;  ///< [A]; empty: not known.

  /// Nothing, when the simulator cannot show such an experiment, it would ask too much of the drives, or the sensors
  /// would not see it. Rows that the camera does not see are taken out of the proposal.
  std::optional<Score> score(Proposal& proposal, bool with_nuisance) const;

  /// Separation when the wrong alternative is fitted to the recording and the proposal together, through the simulator.
  double confirmed(const FitContext& context, const Proposal& proposal) const;
};

/// Largest current of each motor that was recorded [A]; empty when none was.
Eigen::VectorXd highest_current(const cell::Recording& recording);

}  // namespace kr5::gap
