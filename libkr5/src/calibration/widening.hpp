// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/uncertainty/confidence.hpp>

/// @file
/// Private: the one way in which covariances are stated when the noise was estimated along.

namespace kr5::calibration {

constexpr double noise_given = 1e6;  ///< Degrees of freedom behind a covariance for which nothing was estimated [-].

/// Factor for the covariance of `numbers` numbers that is estimated on `dof` degrees of freedom, after which its normal
/// 95 % region, as from uncertainty::confidence_ellipsoid, is the one of Fisher's F [-].
inline double widening(double numbers, double dof) {
  return numbers * uncertainty::fisher_quantile(0.95, numbers, dof) / uncertainty::chi_square_quantile(0.95, numbers);
}

}  // namespace kr5::calibration
