// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

namespace kr5::vision {

/// Points seen of a target: indices into `target_points`, pixels and their standard deviations.
struct SeenPoints {
  std::vector<int> index;
  std::vector<Eigen::Vector2d> pixel;
  std::vector<double> sigma;  ///< [px], 0 when not refined.

  void add(int i, const Eigen::Vector2d& p, double s) { index.push_back(i), pixel.push_back(p), sigma.push_back(s); }
};

}  // namespace kr5::vision
