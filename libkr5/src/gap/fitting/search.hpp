// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "gap/screening/screen.hpp"

/// @file
/// Which sets of effects explain a recording best: singles, pairs and more, kept only while they pay.

namespace kr5::gap {

struct SearchOptions {
  int max_effects = 0;  ///< These four as in DiagnoseOptions.
  int refits = 0;
  int beam = 0;
  int threads = 0;
};

/// All models that were fitted, most likely first; the nominal cell is one of them.
std::vector<Model> search(const FitProblem& problem, Screen& screen, const Eigen::VectorXd& base,
                          const SearchOptions& options, const std::function<void(double)>& progress);

/// The same from a fitted set of effects, out of reach of the nominal cell: the screen's signatures are those about it.
std::vector<Model> search_from(const FitProblem& problem, Screen& screen, const Eigen::VectorXd& base,
                               const Model& start, const SearchOptions& options,
                               const std::function<void(double)>& progress);

/// A fitted model with each further effect that could explain what it leaves, as sets that are not fitted yet.
/// `replaced`: a part that the model had; then only effects whose gain comes near its own, which is at least `lost`:
/// the evidence that the model has lost without it.
std::vector<std::vector<Part>> extensions(const FitProblem& problem, Screen& screen, const Model& model,
                                          const SearchOptions& options, const Part* replaced = nullptr,
                                          double lost = 0.0);

}  // namespace kr5::gap
