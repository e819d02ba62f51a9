// SPDX-License-Identifier: BSD-3-Clause
#include "identification/dynamics/column_algebra.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <Eigen/QR>

namespace kr5::identification {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

IndependentColumns independent_columns(const MatrixXd& A, const std::vector<int>& order, double tolerance,
                                       double nothing) {
  IndependentColumns out;
  out.basis.resize(A.rows(), std::min(A.rows(), A.cols()));
  Index rank = 0;
  for (const int c : order) {
    const double length = A.col(c).norm();
    if (length <= nothing || rank == out.basis.cols()) continue;
    VectorXd left = A.col(c);
    for (int turn = 0; turn < 2; ++turn)  // the second takes out what the first left by rounding
      left -= out.basis.leftCols(rank) * (out.basis.leftCols(rank).transpose() * left).eval();
    const double remains = left.norm();
    if (remains <= tolerance * length) continue;
    out.basis.col(rank++) = left / remains;
    out.columns.push_back(c);
  }
  out.basis.conservativeResize(Eigen::NoChange, rank);
  return out;
}

ColumnSplit split_columns(const MatrixXd& A, const std::vector<int>& order, double tolerance) {
  ColumnSplit out;
  if (A.cols() == 0) return out;
  const double nothing = 1e-10 * A.colwise().norm().maxCoeff();  // a column of rounding alone
  out.independent = independent_columns(A, order, tolerance, nothing).columns;
  std::sort(out.independent.begin(), out.independent.end());
  out.dependent = order;
  std::sort(out.dependent.begin(), out.dependent.end());
  std::erase_if(out.dependent,
                [&](int c) { return std::binary_search(out.independent.begin(), out.independent.end(), c); });
  if (out.independent.empty() || out.dependent.empty()) {
    out.coefficients =
        MatrixXd::Zero(static_cast<Index>(out.independent.size()), static_cast<Index>(out.dependent.size()));
    return out;
  }
  const MatrixXd kept = A(Eigen::all, out.independent);
  const VectorXd length = kept.colwise().norm();
  const MatrixXd others = A(Eigen::all, out.dependent);
  const Eigen::HouseholderQR<MatrixXd> qr(MatrixXd(kept * length.cwiseInverse().asDiagonal()));
  out.coefficients = length.cwiseInverse().asDiagonal() * qr.solve(others);
  for (Index d = 0; d < others.cols(); ++d)  // rounding, which would stand in expressions
    for (Index k = 0; k < length.size(); ++k)
      if (std::abs(out.coefficients(k, d)) * length[k] <= std::max(1e-9 * others.col(d).norm(), nothing))
        out.coefficients(k, d) = 0.0;
  return out;
}

MatrixXd triangular_factor(const Eigen::Ref<const MatrixXd>& A) {
  if (A.cols() == 0) return MatrixXd(0, 0);
  const Index p = A.cols(), part = std::max<Index>(4 * p, 64);
  MatrixXd work = MatrixXd::Zero(p + part, p);
  for (Index first = 0; first < A.rows(); first += part) {
    const Index count = std::min(part, A.rows() - first);
    work.middleRows(p, count) = A.middleRows(first, count);
    Eigen::Ref<MatrixXd> rows = work.topRows(p + count);
    const Eigen::HouseholderQR<Eigen::Ref<MatrixXd>> in_place(rows);
    work.topRows(p).triangularView<Eigen::StrictlyLower>().setZero();
  }
  return work.topRows(p);
}

MatrixXd stacked_factor(const std::vector<MatrixXd>& factors, const std::vector<std::vector<int>>& positions,
                        Index columns, const VectorXd& weights) {
  Index rows = 0;
  for (const MatrixXd& R : factors) rows += R.rows();
  MatrixXd all = MatrixXd::Zero(rows, columns);
  Index first = 0;
  for (std::size_t i = 0; i < factors.size(); ++i) {
    const MatrixXd& R = factors[i];
    const double weight = weights[static_cast<Index>(i)];
    for (Index c = 0; c < R.cols(); ++c) {
      const bool last = c == static_cast<Index>(positions[i].size());
      const Index to = last ? columns - 1 : positions[i][static_cast<std::size_t>(c)];
      all.col(to).segment(first, R.rows()) = weight * R.col(c);
    }
    first += R.rows();
  }
  return triangular_factor(all);
}

std::vector<std::vector<int>> column_positions(const std::vector<JointRegressor>& rows,
                                               const std::vector<int>& columns) {
  std::vector<std::vector<int>> out;
  for (const JointRegressor& joint : rows) {
    std::vector<int> at;
    for (const int c : joint.columns)
      at.push_back(static_cast<int>(std::lower_bound(columns.begin(), columns.end(), c) - columns.begin()));
    out.push_back(at);
  }
  return out;
}

std::string linear_expression(const VectorXd& coefficients, const std::vector<std::string>& names) {
  std::string out;
  for (Index k = 0; k < coefficients.size(); ++k) {
    const double c = coefficients[k];
    if (c == 0.0) continue;
    out += out.empty() ? (c < 0 ? "-" : "") : (c < 0 ? " - " : " + ");
    char number[32];
    std::snprintf(number, sizeof number, "%.6g", std::abs(c));
    if (std::string(number) != "1") out += std::string(number) + " ";
    out += names[static_cast<std::size_t>(k)];
  }
  return out.empty() ? "0" : out;
}

std::vector<int> preferred_order(int joints, int parameters) {
  std::vector<int> order;
  const auto add = [&](std::initializer_list<int> kinds) {
    for (int i = 0; i < joints; ++i)
      for (const int k : kinds) order.push_back(parameters_per_joint * i + k);
  };
  add({0, 1, 2, 4, 5, 10, 11});  // inertias but Iyy, friction
  for (int c = parameters_per_joint * joints; c < parameters; ++c) order.push_back(c);
  add({3});     // Iyy
  add({12});    // rotor
  add({6, 7});  // m cx, m cy
  add({8});     // m cz
  add({9});     // m
  return order;
}

}  // namespace kr5::identification
