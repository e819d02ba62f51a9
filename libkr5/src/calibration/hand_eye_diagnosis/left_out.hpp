// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "calibration/hand_eye_diagnosis/reading_fit.hpp"

namespace kr5::calibration::evidence {

/// Squared error [m^2] of a point at the target's distance, the better of a plane's two poses counting.
double squared_point_error(const Pose& T_base_flange, const Sighting& sighting, const ReadingFit& fit, Mount mount);
/// RMS error [m] of a point at the target's distance, on pairs left out in turn (at most `folds` fits).
double held_out_rms(const Reading& reading, const Sightings& sightings, int folds = 6);

}  // namespace kr5::calibration::evidence
