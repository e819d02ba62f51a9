// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "gap/fitting/model_pool.hpp"
#include "gap/stages/screen_stage.hpp"

/// @file
/// Fourth stage of a diagnosis: sets of effects, fitted through the simulator.

namespace kr5::gap {

/// Sets of effects about as likely as the best whose effects are exchanged for others, at most.
constexpr std::size_t most_examined = 20;

struct SearchOutput {
  std::vector<std::shared_ptr<const Candidate>> candidates;  ///< To which the parts of the models point.
  ModelSets models;
  NuisancePrior prior;  ///< Of the nuisance parameters in the models.
  double log_prior_effect = 0.0;
  bool far = false;        ///< As of the problem to which they were fitted.
  bool cut_short = false;  ///< More sets than are examined were about as likely as the best.

  /// What the models were fitted to: this or another state of the data of the screening.
  FitProblem problem(const ComparisonData& data, const NuisanceModel& nuisance) const {
    return {data, nuisance, prior, log_prior_effect, far ? Slopes::WhereNeeded : Slopes::AtEachPoint, 0.0, far};
  }
};

/// The best model has needed effects only (see needed_effects.hpp), and neither a further effect betters it nor another
/// in the place of one.
SearchOutput search_stage(const ScreenOutput& screened, const DiagnoseOptions& options);

/// The start of start_stage() as the one model.
SearchOutput start_search(const ScreenOutput& screened);

}  // namespace kr5::gap
