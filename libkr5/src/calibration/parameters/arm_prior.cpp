// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/parameters/arm_prior.hpp"

#include <cmath>

namespace kr5::calibration::parameters {

void free_arm(fit::Problem& fit, fit::FitBlock arm, const kinematics::DhChain& nominal, double length, double angle) {
  constexpr double near_parallel = 0.1;  // sine of the angle below which two axes get beta
  const std::size_t joints = nominal.joints.size();
  Eigen::VectorXd prior(static_cast<Eigen::Index>(5 * joints));
  for (std::size_t i = 0; i < joints; ++i) {
    const bool parallel = i + 1 < joints && std::abs(std::sin(nominal.joints[i].alpha)) < near_parallel;
    if (!parallel) fit.hold(arm, static_cast<int>(5 * i) + 4);
    prior.segment<5>(static_cast<Eigen::Index>(5 * i)) << length, angle, length, angle, angle;
  }
  fit.set_prior(arm, prior);
}

}  // namespace kr5::calibration::parameters
