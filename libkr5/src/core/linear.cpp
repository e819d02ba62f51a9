// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/core/linear.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

namespace kr5 {

SymmetricEigen symmetric_eigen(const Eigen::Ref<const Eigen::MatrixXd>& A) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::VectorXd singular_values(const Eigen::Ref<const Eigen::MatrixXd>& A) {
  return Eigen::JacobiSVD<Eigen::MatrixXd>(A).singularValues();
}

}  // namespace kr5
