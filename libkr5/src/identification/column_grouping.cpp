// SPDX-License-Identifier: BSD-3-Clause
#include "column_grouping.hpp"

#include <algorithm>
#include <cmath>

namespace kr5::identification {

ColumnGrouping grouped_columns(const Eigen::MatrixXd& A, const std::vector<Eigen::Index>& order, double tolerance) {
  ColumnGrouping out;
  const Eigen::VectorXd length = A.colwise().norm();
  const double zero = 1e-12 * length.maxCoeff();
  Eigen::MatrixXd basis(A.rows(), std::min(A.rows(), A.cols()));
  Eigen::Index found = 0;
  for (const Eigen::Index column : order) {
    if (length[column] <= zero || found == basis.cols()) continue;
    Eigen::VectorXd rest = A.col(column);
    for (int pass = 0; pass < 2; ++pass)  // the second takes out what the first left by rounding
      rest -= basis.leftCols(found) * (basis.leftCols(found).transpose() * rest).eval();
    if (rest.norm() <= tolerance * length[column]) continue;
    basis.col(found++) = rest.normalized();
    out.kept.push_back(column);
  }
  Eigen::MatrixXd R(found, found);
  for (Eigen::Index i = 0; i < found; ++i)
    R.col(i) = basis.leftCols(found).transpose() * A.col(out.kept[static_cast<std::size_t>(i)]);
  out.combination = R.triangularView<Eigen::Upper>().solve(basis.leftCols(found).transpose() * A);
  out.combination = out.combination.unaryExpr([](double c) { return std::abs(c) < 1e-9 ? 0.0 : c; });
  for (Eigen::Index i = 0; i < found; ++i)  // exactly, whatever rounding left
    out.combination.col(out.kept[static_cast<std::size_t>(i)]) = Eigen::VectorXd::Unit(found, i);
  return out;
}

}  // namespace kr5::identification
