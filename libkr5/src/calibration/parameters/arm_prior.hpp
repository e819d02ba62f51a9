// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/fit/problem.hpp>

/// @file
/// Private: the parameters of an arm in a fit.

namespace kr5::calibration::parameters {

/// Frees what tells one arm from another and ties it to the nominal arm by the spread of lengths [m] and angles [rad].
/// Hayati's beta is free only between axes that are nearly parallel, where it tells what b cannot.
void free_arm(fit::Problem& fit, fit::FitBlock arm, const kinematics::DhChain& nominal, double length, double angle);

}  // namespace kr5::calibration::parameters
