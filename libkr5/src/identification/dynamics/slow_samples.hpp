// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/identification/joint_motion.hpp>

namespace kr5::identification {

/// Samples in which a joint moves slowly, so that its torque is gravity and friction of a known direction.
struct SlowSamples {
  int joint = 0;
  std::vector<Eigen::Index> rows;
  bool several_speeds = false;  ///< Coulomb and viscous friction can be told apart.
  bool resting = false;         ///< The joint stands, so that its friction has no known direction.
};

/// One a joint. Samples in which any joint is faster than `max_speed` are left out.
std::vector<SlowSamples> slow_samples(const JointMotion& motion, double min_speed, double max_speed);

/// Every sample of every joint, one a joint, of postures at rest.
std::vector<SlowSamples> resting_samples(const JointMotion& postures);

/// Number of samples held out, the last of so many.
Eigen::Index held_out_count(Eigen::Index samples, double part);

/// Why postures at rest, or slow samples, determine no gravity; empty when they may.
std::string objection_to_postures(Eigen::Index postures, double held_out);
std::string objection(const JointMotion& motion, const std::vector<SlowSamples>& samples, double held_out);

}  // namespace kr5::identification
