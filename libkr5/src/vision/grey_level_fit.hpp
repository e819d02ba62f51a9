// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include <kr5/core/levenberg_marquardt.hpp>

/// @file
/// Fits of a few parameters to the grey levels of an image.

namespace kr5::vision {

/// Scale of a residual before the first step: nothing is weighted down.
constexpr double unknown_scale = 1e6;
constexpr double huber_limit = 3.0;          ///< [scales]
constexpr double pixel_variance = 1.0 / 12;  ///< A pixel averages over its own square [px^2].
constexpr double min_sigma = 0.5;            ///< Of rounding to whole greys, and of what a model leaves [grey].

template <int N>
struct GreyLevelFit {
  Eigen::Matrix<double, N, 1> x;
  Eigen::Matrix<double, N, N> covariance = Eigen::Matrix<double, N, N>::Zero();
  double sigma = 0.0;  ///< Of one residual.
  bool usable = false;
};

/// Minimises the Huber loss of residuals (model - seen) in grey levels. `equations(x, scale)` returns the
/// NormalEquations at x with residuals weighted down beyond `huber_limit * scale`; the scale is estimated from the
/// residuals, from the given one on. `tolerance`: as in LevenbergMarquardtOptions.
template <int N, class Equations>
GreyLevelFit<N> fit_grey_levels(const Eigen::Matrix<double, N, 1>& start, const Equations& equations_of,
                                double tolerance, double scale = unknown_scale) {
  using Vector = Eigen::Matrix<double, N, 1>;
  struct Problem {
    const Equations& equations_of;
    double scale;

    NormalEquations<N> equations(const Vector& x) const { return equations_of(x, scale); }
    bool reweigh(const Vector&, const NormalEquations<N>& at) {
      const double estimated = std::max(std::sqrt(at.variance()), min_sigma);
      if (std::abs(estimated - scale) <= 0.2 * scale) return false;
      scale = estimated;
      return true;
    }
  } problem{equations_of, scale};
  const auto found =
      levenberg_marquardt<N>(start, problem, {.max_iterations = 30, .tolerance = tolerance, .min_sigma = min_sigma});
  GreyLevelFit<N> fit;
  fit.x = found.x;
  fit.sigma = std::sqrt(found.equations.variance());
  const auto covariance = found.equations.covariance();
  fit.usable = found.usable() && found.equations.count > N && covariance;
  if (covariance) fit.covariance = *covariance;
  return fit;
}

}  // namespace kr5::vision
