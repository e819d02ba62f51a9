// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "calibration/scanner/scanner_problem.hpp"

/// @file
/// Private: where a scanner calibration begins.

namespace kr5::calibration::scanner_problem {

/// Poses of the scanner to begin at, the most promising first: a closed form from tips, spheres and known planes, a
/// search over the normals of an unknown plane, and the nominal pose.
std::vector<Pose> scanner_starts(const ScannerInput& input);

/// Targets as a pose of the scanner implies them: medians of what the profiles show.
ScannerPlacement place_targets(const ScannerInput& input, const Pose& T_flange_scanner);

/// Median over the views of how far each is from its target [m].
double median_distance(const ScannerInput& input, const Pose& T_flange_scanner);

/// Lengths of the X and Z axes of the scanner as the profiles have them, 1 unless their coordinates are scaled, with
/// standard deviations; empty where tips and known planes do not determine them.
struct AxisScales {
  Eigen::Vector2d scale, std;
};
std::optional<AxisScales> axis_scales(const ScannerInput& input, const std::vector<double>& weights);

}  // namespace kr5::calibration::scanner_problem
