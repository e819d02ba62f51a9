// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gap/screening/noise.hpp"
#include "gap/stages/compare_stage.hpp"

/// @file
/// Second stage of a diagnosis: how large noise and known errors of each column are, and what stands out of them.

namespace kr5::gap {

struct NoiseOutput {
  ComparisonData data;                ///< With the noise that counts; spikes are marked.
  Eigen::VectorXd base;               ///< Residuals of the nominal cell over that noise.
  std::vector<NoiseScale> corrected;  ///< Noise that was seen, where it is not as declared.
  std::vector<ColumnName> coarse;     ///< Columns that show almost no noise.
  std::vector<ColumnError> excused;   ///< Columns in which the simulator is known to be off.
  int spikes = 0;
};

/// @throws InvalidArgument for an error of a column that is not compared.
NoiseOutput noise_stage(const CompareOutput& compared, const DiagnoseOptions& options);

}  // namespace kr5::gap
