// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/fit/measurements/plane_point.hpp>

#include <utility>

#include <kr5/core/error.hpp>

namespace kr5::fit {

PlanePointMeasurement::PlanePointMeasurement(PoseChain chain, const FitPoint& point, double sigma)
    : chain_(std::move(chain)), point_(point), sigma_(sigma) {
  require(sigma > 0, "sigma must be positive [m]");
}

void PlanePointMeasurement::declare(BlockUse& use) const { use.chain(chain_), use.point(point_); }

bool PlanePointMeasurement::evaluate(const Evaluation& e) const {
  const auto at = e.state(chain_);
  if (!at) return false;
  const Eigen::Vector3d p = e.point(point_);
  const double whitening = 1 / sigma_;
  e.residuals()[0] = whitening * (at->T * p).z();
  if (!e.derivatives()) return true;
  e.add(*at, whitening * point_by_pose(at->T, p).row(2));
  e.add(point_.block, whitening * at->T.linear().row(2));
  return true;
}

}  // namespace kr5::fit
