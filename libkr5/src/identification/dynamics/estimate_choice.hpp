// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/identification/dynamics.hpp>

namespace kr5::identification {

/// Options with the estimator, the spread of the priors and the least speed under which each third of the samples is
/// predicted best from the other two: the least sum over joints of the logarithm of the mean squared error, at all
/// samples. Thirds are motions that the estimate has not seen; short blocks would be interpolated by their neighbours,
/// which speaks for too many parameters.
/// @return The options as they were when no estimate of two thirds may be used.
DynamicsOptions choose_estimate(const JointMotion& motion, const DynamicsModel& model, const DynamicsOptions& options);

}  // namespace kr5::identification
