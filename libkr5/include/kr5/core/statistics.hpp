// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

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

}  // namespace kr5
