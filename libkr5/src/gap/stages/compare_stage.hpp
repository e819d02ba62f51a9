// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/gap/diagnose.hpp>

#include "gap/comparison_data.hpp"

/// @file
/// First stage of a diagnosis: what was recorded beside what the nominal cell shows.

namespace kr5::gap {

struct CompareOutput {
  ComparisonData data;
  Eigen::VectorXd base;  ///< Residuals of the nominal cell, stacked, over the declared noise.
  std::vector<MissingSplit> missing_splits;
  std::vector<ScopeLimit> scope;
};

/// The output refers to recording and simulator.
/// @throws InvalidArgument when nothing can be compared.
CompareOutput compare_stage(const cell::Recording& recording, const cell::Simulator& simulator,
                            const DiagnoseOptions& options);

}  // namespace kr5::gap
