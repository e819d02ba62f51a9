// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/gap/diagnosis.hpp>

#include "gap/fitting/fit.hpp"

/// @file
/// How sure one may be of each effect, from all sets of effects that were fitted.

namespace kr5::gap {

bool contains(const std::vector<EffectName>& names, const EffectName& name);
EffectName name_of(const Part& part);

/// Weights of models (sum 1) from their evidence, softened by the misfit that stays in what the best one touches: when
/// its errors are s times the noise, differences of chi-square count for 1/s^2.
struct Posterior {
  std::vector<double> weights;
  double temperature = 1.0;
};
Posterior posterior(const FitProblem& problem, const std::vector<Model>& models);

/// Probability that the cell carries this effect on this target.
double probability(const std::vector<Model>& models, const Posterior& posterior, const EffectName& name);

/// Odds against the best model, above which another one is tied with it.
constexpr double min_tied_odds = 0.05;

/// Effects that could stand in the place of one part of a model, of models that are tied with it.
std::vector<EffectName> ties(const std::vector<Model>& models, const Posterior& posterior, const Model& best,
                             std::size_t part);

/// Covariance of the coordinates of a part.
Eigen::MatrixXd coordinate_covariance(const Model& model, std::size_t part, double temperature);

/// Whether any coordinate of a part is further than two standard deviations from where the effect is off.
bool is_significant(const Model& model, std::size_t part, double temperature);

/// Parameters of a part as the cell holds them, with the standard deviations that the information about its coordinates
/// gives.
std::vector<ParameterEstimate> parameters(const ComparisonData& data, const Model& model, std::size_t part,
                                          double temperature);

}  // namespace kr5::gap
