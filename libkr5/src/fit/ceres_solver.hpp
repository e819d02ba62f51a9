// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fit/problem_data.hpp"

/// @file
/// Private: the one source that sees Ceres.

namespace kr5::fit {

/// Minimises from the present values, keeps what it found in the blocks, and reports it: `fit`, `cost`, `residuals`.
void minimise(ProblemData& data, const SolveOptions& options, Solution& solution);

}  // namespace kr5::fit
