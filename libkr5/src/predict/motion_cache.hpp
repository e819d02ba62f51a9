// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/kinematics/newton_euler.hpp>

#include "predict/lru_cache.hpp"

namespace kr5::predict {

/// Position, speed and acceleration of one axis, a row a sample.
using AxisResponse = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// How axes followed, and what moved the arm so. A motion of a minute is 3 MB.
class MotionCache {
 public:
  LruCache<AxisResponse> axes{1'000'000, [](const AxisResponse& of) { return static_cast<std::size_t>(of.size()); }};
  LruCache<kinematics::MotionLoads> loads{8'000'000, [](const kinematics::MotionLoads& of) {
                                            return static_cast<std::size_t>(of.tau.size() + of.wrench.size());
                                          }};
};

}  // namespace kr5::predict
