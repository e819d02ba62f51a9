// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/identification/joint_motion.hpp>

/// @file
/// Noise whose neighbouring values are alike, as of a filter in a driver or of a slow ripple in a supply.

namespace kr5::arm_log {

struct NoiseColour {
  double sigma = 0.0;        ///< Standard deviation of the noise in its unit; 0: not found to be coloured.
  double correlation = 0.0;  ///< Of neighbouring rows [-].
};

/// Whether what a freely fitted arm leaves of the load of a joint is coloured noise: alike in neighbouring rows, of a
/// short memory, and nothing of it predicted on other rows by position, direction, speed, acceleration, load or time.
/// What such functions predict is an error of the arm, not noise.
/// @param left In the rows of the motion; 0 where the direction of the joint is not known, the others weighted so that
/// the mean square of all is that of those that are known. @param joint From 0.
NoiseColour noise_colour(const identification::JointMotion& motion, const Eigen::Ref<const Eigen::VectorXd>& left,
                         int joint);

}  // namespace kr5::arm_log
