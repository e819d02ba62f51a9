// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/best_assignment.hpp"

#include <limits>

#include <kr5/core/error.hpp>

namespace kr5::calibration {

std::vector<int> best_assignment(const Eigen::MatrixXd& cost) {
  require(cost.rows() == cost.cols() && cost.allFinite(), "cost must be a square matrix of finite numbers");
  const int n = static_cast<int>(cost.rows());
  const double infinity = std::numeric_limits<double>::infinity();
  std::vector<double> u(n + 1), v(n + 1);
  std::vector<int> row_of(n + 1), way(n + 1);
  for (int i = 1; i <= n; ++i) {
    std::vector<double> least(n + 1, infinity);
    std::vector<char> used(n + 1, false);
    row_of[0] = i;
    int j0 = 0;
    do {
      used[j0] = true;
      int j1 = 0;
      double delta = infinity;
      for (int j = 1; j <= n; ++j) {
        if (used[j]) continue;
        const double reduced = cost(row_of[j0] - 1, j - 1) - u[row_of[j0]] - v[j];
        if (reduced < least[j]) least[j] = reduced, way[j] = j0;
        if (least[j] < delta) delta = least[j], j1 = j;
      }
      for (int j = 0; j <= n; ++j) {
        if (used[j])
          u[row_of[j]] += delta, v[j] -= delta;
        else
          least[j] -= delta;
      }
      j0 = j1;
    } while (row_of[j0] != 0);
    for (; j0 != 0; j0 = way[j0]) row_of[j0] = row_of[way[j0]];
  }
  std::vector<int> column(n);
  for (int j = 1; j <= n; ++j) column[row_of[j] - 1] = j - 1;
  return column;
}

}  // namespace kr5::calibration
