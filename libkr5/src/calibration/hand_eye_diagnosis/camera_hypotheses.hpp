// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "calibration/hand_eye_diagnosis/hypotheses.hpp"

namespace kr5::calibration::evidence {

/// Readings in which some intrinsic parameters of the camera are free.
std::vector<SetupHypothesis> other_camera(const Case& c);
/// RMS error [m] of a point at the target's distance on views left out, `freedom` parameters of the camera (as in
/// `other_camera`) being found without them, too.
double held_out_with_camera(const Case& c, int freedom, int folds = 6);

}  // namespace kr5::calibration::evidence
