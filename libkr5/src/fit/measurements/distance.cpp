// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/fit/measurements/distance.hpp>

#include <cmath>
#include <utility>

#include <kr5/core/error.hpp>

namespace kr5::fit {

DistanceMeasurement::DistanceMeasurement(PoseChain chain, const FitPoint& point, const FitPoint& other,
                                         const FitNumber& distance, double sigma)
    : chain_(std::move(chain)), point_(point), other_(other), distance_(distance), sigma_(sigma) {
  require(sigma > 0 && std::isfinite(distance.value), "sigma must be positive and distance finite [m]");
}

void DistanceMeasurement::declare(BlockUse& use) const {
  use.chain(chain_), use.point(point_), use.point(other_), use.number(distance_, "distance");
}

bool DistanceMeasurement::evaluate(const Evaluation& e) const {
  const auto at = e.state(chain_);
  if (!at) return false;
  const Eigen::Vector3d p = e.point(point_), between = at->T * p - e.point(other_);
  const double length = between.norm(), whitening = 1 / sigma_;
  if (!(length > 1e-12)) return false;  // without a direction in which it could change
  e.residuals()[0] = whitening * (length - e.number(distance_));
  if (!e.derivatives()) return true;
  const Eigen::RowVector3d along = whitening / length * between.transpose();
  e.add(*at, along * point_by_pose(at->T, p));
  e.add(point_.block, along * at->T.linear());
  e.add(other_.block, -along);
  e.add(distance_.block, Eigen::Matrix<double, 1, 1>(-whitening));
  return true;
}

}  // namespace kr5::fit
