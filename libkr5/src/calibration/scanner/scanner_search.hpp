// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "calibration/scanner/scanner_problem.hpp"

/// @file
/// Private: places from which the calibration of a scanner begins, whatever its rotation.

namespace kr5::calibration::scanner_problem {

/// Poses that tips and spheres may have been seen from, the likeliest first: where searches from rotations all
/// over end, in which a sphere may lie on either side of a profile. Empty where fewer than
/// four profiles show a tip or a sphere.
std::vector<Pose> searched_poses(const ScannerInput& input);

}  // namespace kr5::calibration::scanner_problem
