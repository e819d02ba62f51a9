// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include <Eigen/Core>

/// @file
/// Scales that outliers do not move.

namespace kr5 {

/// Standard deviation over median absolute deviation, of a normal variable [-].
inline constexpr double mad_to_sigma = 1.4826;

/// The middle of the values in their order, of an even number the upper of both; 0 of none.
inline double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The same, of an even number the mean of both, as people state it.
inline double midpoint_median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const std::size_t n = values.size();
  const double upper = median(values);
  if (n % 2 == 1) return upper;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(n / 2 - 1), values.end());
  return 0.5 * (values[n / 2 - 1] + upper);
}

/// Standard deviation of the noise of a series by its third differences, in which what is smooth cancels; steps and
/// outliers do not move it. 0 of fewer than four values, and where most values repeat, as between the steps of a coarse
/// reading.
inline double difference_noise(const Eigen::Ref<const Eigen::VectorXd>& x) {
  std::vector<double> third;
  for (Eigen::Index i = 3; i < x.size(); ++i) third.push_back(std::abs(x[i] - 3 * x[i - 1] + 3 * x[i - 2] - x[i - 3]));
  return mad_to_sigma * median(std::move(third)) / std::sqrt(20.0);  // 1 + 9 + 9 + 1, of independent values
}

/// Standard deviation of the noise of readings in the order of time; of coarse numbers at least that of their step.
inline double reading_noise(const Eigen::Ref<const Eigen::VectorXd>& x) {
  double step = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 1; i < x.size(); ++i)
    if (x[i] != x[i - 1]) step = std::min(step, std::abs(x[i] - x[i - 1]));
  const double coarse = std::isfinite(step) ? step / std::sqrt(12.0) : 0.0;
  return std::max(difference_noise(x), coarse);
}

/// Where the signs of values are known beside their noise: 1 at two standard deviations or more, 0 below. All 1 where
/// fewer than a tenth are known, since nothing else tells of them, and for exact values (`noise` 0).
inline Eigen::ArrayXd known_signs(const Eigen::Ref<const Eigen::ArrayXd>& values, double noise) {
  constexpr double sure = 2.0, least = 0.1;
  const Eigen::ArrayXd known = (values.abs() >= sure * noise).cast<double>();
  return known.sum() >= least * static_cast<double>(known.size()) ? known : Eigen::ArrayXd::Ones(values.size());
}

}  // namespace kr5
