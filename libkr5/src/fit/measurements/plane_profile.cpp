// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/fit/measurements/plane_profile.hpp>

#include <utility>

#include <kr5/core/error.hpp>

#include "fit/whitening.hpp"

namespace kr5::fit {

PlaneProfileMeasurement::PlaneProfileMeasurement(PoseChain chain, Eigen::Matrix3Xd points,
                                                 const Eigen::MatrixXd& covariance)
    : chain_(std::move(chain)), points_(std::move(points)) {
  require(points_.cols() > 0 && points_.allFinite(), "points on a plane must be finite, and at least one [m]");
  set_covariance(covariance);
}

void PlaneProfileMeasurement::set_covariance(const Eigen::MatrixXd& covariance) {
  whitening_ = whitening_of<Eigen::Dynamic>(covariance, points_.cols());
}

bool PlaneProfileMeasurement::evaluate(const Evaluation& e) const {
  const auto at = e.state(chain_);
  if (!at) return false;
  Eigen::VectorXd height(points_.cols());
  Eigen::Matrix<double, Eigen::Dynamic, 6> by_chain(points_.cols(), 6);
  for (Eigen::Index k = 0; k < points_.cols(); ++k) {
    height[k] = (at->T * Eigen::Vector3d(points_.col(k))).z();
    by_chain.row(k) = point_by_pose(at->T, points_.col(k)).row(2);
  }
  e.residuals() = whitening_ * height;
  if (e.derivatives()) e.add(*at, whitening_ * by_chain);
  return true;
}

}  // namespace kr5::fit
