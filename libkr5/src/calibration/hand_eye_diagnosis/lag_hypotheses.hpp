// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "calibration/hand_eye_diagnosis/hypotheses.hpp"

namespace kr5::calibration::evidence {

/// Readings in which the poses were taken somewhat before or after the images.
std::vector<SetupHypothesis> delayed_readings(const Case& c);

}  // namespace kr5::calibration::evidence
