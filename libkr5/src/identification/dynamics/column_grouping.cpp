// SPDX-License-Identifier: BSD-3-Clause
#include "identification/dynamics/column_grouping.hpp"

#include <cmath>

#include "identification/dynamics/column_algebra.hpp"

namespace kr5::identification {

ColumnGrouping grouped_columns(const Eigen::MatrixXd& A, const std::vector<Eigen::Index>& order, double tolerance) {
  const auto [columns, basis] =
      independent_columns(A, {order.begin(), order.end()}, tolerance, 1e-12 * A.colwise().norm().maxCoeff());
  ColumnGrouping out{.kept = {columns.begin(), columns.end()}, .combination = {}};
  const auto found = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd R(found, found);
  for (Eigen::Index i = 0; i < found; ++i) R.col(i) = basis.transpose() * A.col(out.kept[static_cast<std::size_t>(i)]);
  out.combination = R.triangularView<Eigen::Upper>().solve(basis.transpose() * A);
  out.combination = out.combination.unaryExpr([](double c) { return std::abs(c) < 1e-9 ? 0.0 : c; });
  for (Eigen::Index i = 0; i < found; ++i)  // exactly, whatever rounding left
    out.combination.col(out.kept[static_cast<std::size_t>(i)]) = Eigen::VectorXd::Unit(found, i);
  return out;
}

}  // namespace kr5::identification
