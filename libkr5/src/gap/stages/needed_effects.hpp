// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/gap/diagnose.hpp>

#include "gap/fitting/model_pool.hpp"
#include "gap/reporting/structure.hpp"

/// @file
/// Which effects of a model it could do without.

namespace kr5::gap {

/// Whether what the nuisance parameters take from the residual of a model is as small as their size says, in every one
/// of them. One that is far off is no small error but an effect, for which they must not stand.
bool within_nuisance(const FitProblem& problem, const Model& model);

/// Whether a part of a model makes the check experiments fit worse, or explains no more than the simulator may be off.
/// Fits the model without it, if that was not done.
bool is_needless(ModelPool& models, const std::vector<Group>& groups, const Model& model, std::size_t part,
                 const DiagnoseOptions& options);

}  // namespace kr5::gap
