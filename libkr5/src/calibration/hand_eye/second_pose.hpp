// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <kr5/fit/pipeline/pipeline.hpp>

#include "calibration/hand_eye/start.hpp"

/// @file
/// Private: what a hand-eye calibration says of another pose of its camera.

namespace kr5::calibration::hand_eye {

/// Tells the second minimum where it is near, and refuses the result where the two cannot be told apart. `dof`: of the
/// noise; `data`: what was measured, in words.
void judge_second(const fit::pipeline::Rival<RobustStart>& rival, double dof, const std::string& data,
                  HandEyeResult& out);

/// Whether a second pose is all that speaks against a result.
bool only_undecided(const HandEyeResult& result);

}  // namespace kr5::calibration::hand_eye
