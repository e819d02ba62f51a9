// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/fit/measurements/sphere_section.hpp>

#include <utility>

#include <kr5/core/error.hpp>

#include "fit/whitening.hpp"

namespace kr5::fit {

SphereSectionMeasurement::SphereSectionMeasurement(PoseChain chain, const FitPoint& centre, const FitNumber& radius,
                                                   const Eigen::Vector3d& section, const Eigen::Matrix3d& covariance)
    : chain_(std::move(chain)), centre_(centre), radius_(radius), section_(section) {
  require((radius.block.exists() || radius.value > 0) && section.allFinite() && section[2] > 0,
          "radii of a sphere and of its section must be positive [m]");
  set_covariance(covariance);
}

void SphereSectionMeasurement::set_covariance(const Eigen::MatrixXd& covariance) {
  whitening_ = whitening_of<3>(covariance);
}

void SphereSectionMeasurement::declare(BlockUse& use) const {
  use.chain(chain_), use.point(centre_), use.number(radius_, "radius");
}

/// With the squares of the radii, so that the sphere may also lie beside the plane while the fit goes on.
bool SphereSectionMeasurement::evaluate(const Evaluation& e) const {
  const auto at = e.state(chain_);
  if (!at) return false;
  const Eigen::Vector3d centre = e.point(centre_), c = at->T * centre;
  const double radius = e.number(radius_), seen = section_[2];
  e.residuals() = whitening_ * Eigen::Vector3d(c.x() - section_[0], c.z() - section_[1],
                                               (radius * radius - c.y() * c.y() - seen * seen) / (2 * seen));
  if (!e.derivatives()) return true;
  Eigen::Matrix3d by_centre = Eigen::Matrix3d::Zero();
  by_centre(0, 0) = by_centre(1, 2) = 1.0;
  by_centre(2, 1) = -c.y() / seen;
  by_centre = whitening_ * by_centre;
  e.add(*at, by_centre * point_by_pose(at->T, centre));
  e.add(centre_.block, by_centre * at->T.linear());
  e.add(radius_.block, whitening_.col(2) * (radius / seen));
  return true;
}

}  // namespace kr5::fit
