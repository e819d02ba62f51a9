// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

/// @file
/// A variance component of a fit, by Förstner's estimate.

namespace kr5::fit {

/// A sum of squared residuals, over their assumed standard deviations, and the share of them that is not fitted.
struct VarianceComponent {
  double squares = 0.0;     ///< [-]
  double redundancy = 0.0;  ///< [-]

  void add(double residual, double share) { squares += residual * residual, redundancy += share; }
  void add(const VarianceComponent& other) { squares += other.squares, redundancy += other.redundancy; }
  /// Variance over the assumed one: 1 when that was right.
  double variance() const { return redundancy > 0 ? squares / redundancy : 1.0; }
  /// Moves an assumed standard deviation to the estimated one, at least `min_sigma`; whether it moved more than 2 %.
  bool update(double& sigma, double min_sigma) const {
    if (redundancy < 1e-6) return false;
    const double before = sigma;
    sigma = std::max(min_sigma, sigma * std::sqrt(variance()));
    return std::abs(std::log(sigma / before)) > settled;
  }

 private:
  static constexpr double settled = 0.02;
};

}  // namespace kr5::fit
