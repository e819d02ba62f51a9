// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "fit/problem_data.hpp"

/// @file
/// Private: measurements as linear functions of the free coordinates, and what is left of them without their nuisance.

namespace kr5::fit {

/// Measurements that share a nuisance, at the present values.
struct GroupDerivatives {
  std::vector<int> index;  ///< Places of the columns of `J` among the free coordinates.
  Eigen::MatrixXd J;       ///< By the free coordinates.
  Eigen::MatrixXd N;       ///< By the nuisance; without columns where there is none.
  Eigen::MatrixXd prior;   ///< The same of its prior: that of its change from the start over the standard deviations.
  Eigen::VectorXd r;
};

/// With the weights in use or another one for all; `condensed`: with as few rows as say the same. Empty where the model
/// does not exist.
std::optional<GroupDerivatives> linearise(const ProblemData& data, const FreeCoordinates& free,
                                          const std::vector<const StoredMeasurement*>& group, bool condensed,
                                          std::optional<double> weight = {});

/// Measurements that take part; those that share a nuisance together.
std::vector<std::vector<const StoredMeasurement*>> groups(const ProblemData& data, const FreeCoordinates& free);

/// What remains of residuals whose nuisance is eliminated: they are M r, with covariance P where the model holds.
struct WithoutNuisance {
  Eigen::MatrixXd M;  ///< Symmetric, M M = I - N (N' N + R' R)^-1 N', R of the prior.
  Eigen::MatrixXd P;  ///< The projector on the range of M: less than the identity where no prior holds the nuisance.
  int rank = 0;
};

WithoutNuisance eliminate(const Eigen::MatrixXd& N, const Eigen::MatrixXd& prior);

/// Derivatives by the free coordinates of as many residuals as tell all that is known with the nuisance eliminated. The
/// residuals are turned, so that this costs little for many of them.
Eigen::MatrixXd without_nuisance(const GroupDerivatives& at);

}  // namespace kr5::fit
