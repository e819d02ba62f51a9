// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <kr5/gap/joint_fit.hpp>

#include "gap/fitting/fit.hpp"

/// @file
/// Where a search begins when the nominal cell is so far off that slopes there lead nowhere.

namespace kr5::gap {

/// The cell with effects at fitted values.
cell::Cell cell_with(const cell::Cell& cell, const std::vector<FittedEffect>& effects);

/// Whether an effect was fitted as the one coordinate of a hypothesis.
bool is_of(const FittedEffect& fitted, const Hypothesis& hypothesis);

/// A hypothesis of one coordinate, at a value of its parameter; nothing where the cell does not reach that value.
std::optional<double> coordinate_at(const cell::Cell& cell, const Hypothesis& hypothesis, double value);

/// Effects at fitted values, refitted. Their candidates are those given, which have the experiments in which they act;
/// effects that none of them is are left out.
Model fit_start(const FitProblem& problem, const Eigen::VectorXd& base, const std::vector<FittedEffect>& effects,
                const std::vector<std::shared_ptr<const Candidate>>& candidates, int threads);

/// Whether slopes at a model tell what the nominal cell shows, so that a search from there leads here.
bool in_reach(const ComparisonData& data, const Model& start, const Eigen::VectorXd& base);

/// A model without one of its parts, as far as its slopes tell: nothing is simulated.
Model linear_without(const FitProblem& problem, const Model& model, std::size_t part);

/// Whether a model that was found by slopes is so much less likely than another that no fit would change that.
bool surely_worse(const Model& linear, const Model& than);

/// A model without the effects that do not pay for themselves as far as its slopes tell, fitted again.
Model without_idle(const FitProblem& problem, const Eigen::VectorXd& base, const Model& model, int threads);

}  // namespace kr5::gap
