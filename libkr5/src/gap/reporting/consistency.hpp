// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gap/fitting/fit.hpp"
#include "gap/reporting/structure.hpp"

namespace kr5::gap {

/// Whether one size of an effect fits everywhere. An effect that follows another law than the cell does wants another
/// size in other experiments, columns, postures, speeds or times: residuals are summed against what a change of the
/// effect would do, piece by piece, and each sum is zero but for noise when the law is right.
struct Inconsistency {
  double p = 1.0;         ///< Probability by chance, corrected for the number of tests.
  double strength = 0.0;  ///< What other sizes elsewhere would explain, above noise, as a sum of squares.
  Variable variable;      ///< What the size changes with.
  std::size_t group = 0;  ///< Column that shows it most.
};

/// `counted` are residuals of the model at its optimum; `discrepancy` is what the simulator may be off with this part,
/// as a sum of squares.
Inconsistency inconsistency(const ComparisonData& data, const std::vector<Group>& groups, const Model& model,
                            std::size_t part, const Eigen::VectorXd& counted, double discrepancy);

}  // namespace kr5::gap
