// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/fit/measurements/pose.hpp>

#include <utility>

#include <kr5/core/error.hpp>
#include <kr5/geometry/pose_derivatives.hpp>

#include "fit/whitening.hpp"

namespace kr5::fit {

PoseMeasurement::PoseMeasurement(PoseChain chain, const Pose& seen) : chain_(std::move(chain)), seen_(seen) {
  require(seen.matrix().allFinite() && is_rotation(seen.linear(), 1e-3), "a seen pose has no proper rotation");
}

PoseMeasurement::PoseMeasurement(PoseChain chain, const Pose& seen, double sigma_position, double sigma_rotation)
    : PoseMeasurement(std::move(chain), seen) {
  require(sigma_position > 0 && sigma_rotation > 0, "standard deviations must be positive [m, rad]");
  whitening_.diagonal() << Eigen::Vector3d::Constant(1 / sigma_position), Eigen::Vector3d::Constant(1 / sigma_rotation);
}

PoseMeasurement::PoseMeasurement(PoseChain chain, const Pose& seen, const Matrix6& covariance)
    : PoseMeasurement(std::move(chain), seen) {
  whitening_ = whitening_of<6>(covariance);
}

void PoseMeasurement::set_covariance(const Eigen::MatrixXd& covariance) { whitening_ = whitening_of<6>(covariance); }

bool PoseMeasurement::evaluate(const Evaluation& e) const {
  const auto at = e.state(chain_);
  if (!at) return false;
  const Vector6 d = pose_difference(seen_, at->T);
  e.residuals() = whitening_ * d;
  if (e.derivatives()) e.add(*at, whitening_ * vector_by_perturbation(d));
  return true;
}

}  // namespace kr5::fit
