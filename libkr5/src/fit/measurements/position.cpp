// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/fit/measurements/position.hpp>

#include <utility>

#include <kr5/core/error.hpp>

#include "fit/whitening.hpp"

namespace kr5::fit {
namespace {

Eigen::Matrix3d covariance_of_position(double sigma) {
  require(sigma > 0, "sigma must be positive [m]");
  return sigma * sigma * Eigen::Matrix3d::Identity();
}

}  // namespace

PositionMeasurement::PositionMeasurement(PoseChain chain, const FitPoint& point, const FitPoint& seen, double sigma)
    : PositionMeasurement(std::move(chain), point, seen, covariance_of_position(sigma)) {}

PositionMeasurement::PositionMeasurement(PoseChain chain, const FitPoint& point, const FitPoint& seen,
                                         const Eigen::Matrix3d& covariance)
    : chain_(std::move(chain)), point_(point), seen_(seen), whitening_(whitening_of<3>(covariance)) {}

void PositionMeasurement::set_covariance(const Eigen::MatrixXd& covariance) {
  whitening_ = whitening_of<3>(covariance);
}

void PositionMeasurement::declare(BlockUse& use) const { use.chain(chain_), use.point(point_), use.point(seen_); }

bool PositionMeasurement::evaluate(const Evaluation& e) const {
  const auto at = e.state(chain_);
  if (!at) return false;
  const Eigen::Vector3d p = e.point(point_);
  e.residuals() = whitening_ * (at->T * p - e.point(seen_));
  if (!e.derivatives()) return true;
  e.add(*at, whitening_ * point_by_pose(at->T, p));
  e.add(point_.block, whitening_ * at->T.linear());
  e.add(seen_.block, -whitening_);
  return true;
}

}  // namespace kr5::fit
