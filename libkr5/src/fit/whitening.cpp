// SPDX-License-Identifier: BSD-3-Clause
#include "fit/whitening.hpp"

#include <Eigen/Dense>
#include <kr5/core/error.hpp>

namespace kr5::fit {

template <int Size>
Eigen::Matrix<double, Size, Size> whitening_of(const Eigen::MatrixXd& covariance, Eigen::Index size) {
  using Square = Eigen::Matrix<double, Size, Size>;
  require(covariance.rows() == size && covariance.cols() == size && covariance.allFinite(),
          "covariance must be finite, of as many rows as there are numbers [m^2, rad^2]");
  const Eigen::LLT<Square> factors{Square(covariance)};
  require(factors.info() == Eigen::Success, "covariance must be positive definite [m^2, rad^2]");
  return factors.matrixL().solve(Square::Identity(size, size));
}

template Eigen::Matrix3d whitening_of<3>(const Eigen::MatrixXd&, Eigen::Index);
template Eigen::Matrix<double, 6, 6> whitening_of<6>(const Eigen::MatrixXd&, Eigen::Index);
template Eigen::MatrixXd whitening_of<Eigen::Dynamic>(const Eigen::MatrixXd&, Eigen::Index);

}  // namespace kr5::fit
