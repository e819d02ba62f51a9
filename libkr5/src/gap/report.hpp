// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gap/verdict.hpp"

/// @file
/// The figures of a diagnosis, on the experiments that were not used to fit.

namespace kr5::gap {

/// Whether a gap is more than noise alone shows once in 1000 columns.
bool above_floor(const Gap& gap);

/// Columns above the floor (99.9 % of chi-square at their samples, or structured), largest share of the excess first.
std::vector<Place> places(const Data& data, const std::vector<Group>& groups, const Rest& rest);

/// The gap before and after over the columns that stand above the floor before.
Shrink shrink_of(const Data& data, const std::vector<Group>& groups, const Eigen::VectorXd& before,
                 const Eigen::VectorXd& after);

/// Part of the excess over those columns that goes from `without` to `with`.
double closed(const Data& data, const std::vector<Group>& groups, const Eigen::VectorXd& before,
              const Eigen::VectorXd& without, const Eigen::VectorXd& with);

/// A short experiment that would tell these apart, by their signatures. @see plan.hpp
NextExperiment next_experiment(const Data& data, const Model& best, const std::vector<Model>& models,
                               const std::vector<Cause>& causes, int threads);

}  // namespace kr5::gap
