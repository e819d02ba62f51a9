// SPDX-License-Identifier: BSD-3-Clause
#include "dry_friction.hpp"

#include <algorithm>
#include <cmath>

namespace kr5::sim {

Eigen::VectorXd hold_or_slide(const Eigen::MatrixXd& response, const Eigen::VectorXd& free,
                              const Eigen::VectorXd& level) {
  constexpr int most_sweeps = 100;
  const Eigen::Index n = free.size();
  Eigen::VectorXd f = Eigen::VectorXd::Zero(n), speed = free;
  // Projected Gauss-Seidel: the box-constrained minimum of a convex function.
  for (int sweep = 0; sweep < most_sweeps; ++sweep) {
    double change = 0.0;
    for (Eigen::Index i = 0; i < n; ++i) {
      const double wanted = std::clamp(f[i] + speed[i] / response(i, i), -level[i], level[i]);
      const double more = wanted - f[i];
      if (more == 0.0) continue;
      f[i] = wanted;
      speed -= more * response.col(i);
      change = std::max(change, std::abs(more) * response(i, i));
    }
    if (change < 1e-14) break;
  }
  return f;
}

}  // namespace kr5::sim
