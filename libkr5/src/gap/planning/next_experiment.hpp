// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/gap/diagnosis.hpp>

#include "gap/fitting/fit.hpp"

namespace kr5::gap {

/// A short experiment that would tell these apart, by their signatures. @see plan.hpp
NextExperiment next_experiment(const ComparisonData& data, const Model& best, const std::vector<Model>& models,
                               const std::vector<Cause>& causes, int threads);

}  // namespace kr5::gap
