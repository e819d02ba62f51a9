// SPDX-License-Identifier: BSD-3-Clause
#include "gap/reporting/residual_owner.hpp"

#include <algorithm>
#include <string>

#include <kr5/core/error.hpp>

namespace kr5::gap {

std::size_t experiment_of(const cell::Recording& recording, const ResidualColumn& column) {
  const auto at = std::find_if(recording.experiments.begin(), recording.experiments.end(),
                               [&](const cell::Experiment& e) { return e.name == column.experiment; });
  require(at != recording.experiments.end() && at->data.values.rows() == column.residuals.rows(),
          "residuals of " + column.experiment + " do not belong to this recording");
  return static_cast<std::size_t>(at - recording.experiments.begin());
}

void require_cell(const ResidualColumn& column, const char* name, int which) {
  require(which >= 0 && which < column.residuals.cols(), std::string(name) + ": found residuals of " +
                                                             std::to_string(column.residuals.cols()) +
                                                             " cells, not of cell " + std::to_string(which));
}

}  // namespace kr5::gap
