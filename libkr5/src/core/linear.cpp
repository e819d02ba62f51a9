// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/core/linear.hpp>

#include <cmath>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace kr5 {

SymmetricEigen symmetric_eigen(const Eigen::Ref<const Eigen::MatrixXd>& A) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::VectorXd singular_values(const Eigen::Ref<const Eigen::MatrixXd>& A) {
  return Eigen::JacobiSVD<Eigen::MatrixXd>(A).singularValues();
}

Eigen::VectorXd least_squares(const Eigen::Ref<const Eigen::MatrixXd>& A, const Eigen::Ref<const Eigen::VectorXd>& b) {
  return Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(A).solve(b);
}

Eigen::MatrixXd covariance_of(const Eigen::MatrixXd& information, double rank_tolerance) {
  const Eigen::VectorXd scale =
      information.diagonal().unaryExpr([](double d) { return d > 0 ? 1 / std::sqrt(d) : 0.0; });
  const SymmetricEigen eigen = symmetric_eigen(Eigen::MatrixXd(scale.asDiagonal() * information * scale.asDiagonal()));
  const double least = rank_tolerance * rank_tolerance;
  const Eigen::VectorXd inverse = eigen.values.unaryExpr([&](double v) { return v > least ? 1 / v : 0.0; });
  const Eigen::MatrixXd V = scale.asDiagonal() * eigen.vectors;
  return V * inverse.asDiagonal() * V.transpose();
}

}  // namespace kr5
