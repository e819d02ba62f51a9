// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/scanner/scanner_problem.hpp"

/// @file
/// Private: what is wrong with the data of a scanner calibration, in words.

namespace kr5::calibration::scanner_problem {

/// Poses that do not turn, or turn about one axis only.
std::optional<ScannerCause> missing_turn(const ScannerInput& input);
/// What else profiles that do not determine the pose may lack.
std::string missing_variety(const ScannerInput& input);

/// Adds the causes that the numbers show: lists of which one is shifted, coordinates that are mirrored, swapped or
/// scaled. A shifted list makes the fit degenerate.
void find_data_causes(const ScannerInput& input, const std::vector<double>& weights, ScannerResult& out);

}  // namespace kr5::calibration::scanner_problem
