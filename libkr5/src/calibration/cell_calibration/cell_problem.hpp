// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <vector>

#include <kr5/calibration/cell_calibration.hpp>
#include <kr5/fit/problem.hpp>

#include "calibration/scanner/scanner_problem.hpp"

/// @file
/// Private: the fit of calibrate_cell, built anew for each set of standard deviations.

namespace kr5::calibration::cell_calibration {

/// Standard deviations of measurements and of the true arm about the nominal one.
struct CellSigmas {
  double pixel = 0.3;      ///< [px]
  double position = 1e-3;  ///< [m]
  double rotation = 1e-3;  ///< [rad]
  double length = 1e-3;    ///< [m]
  double angle = 1e-3;     ///< [rad]
};

/// The scanner's part, found by its own calibration.
struct CellScanInput {
  scanner_problem::ScannerInput input;
  scanner_problem::ScannerSigmas sigmas;
  scanner_problem::ScannerPlacement placement;
  std::vector<bool> outlier;  ///< By profile.
};

/// What is to be fitted: stops with the points of them that take part; without points a stop has no part.
struct CellInput {
  std::span<const CellStop> stops;
  const CellGeometry& believed;
  const CellCalibrationOptions& options;
  std::vector<std::vector<int>> points;  ///< By stop.
  std::optional<CellScanInput> scan = std::nullopt;

  bool has_arm() const { return !believed.arm.joints.empty(); }
};

struct CellProblem {
  fit::Problem fit;
  fit::FitBlock camera, mount, target, arm;
  scanner_problem::ScannerBlocks scanner;
  std::map<int, fit::FitBlock> markers;  ///< By id.
  std::vector<fit::FitBlock> errors;     ///< By stop, of its robot pose; absent where it has no part.
  std::vector<std::vector<fit::FitMeasurement>> observations;  ///< By stop.

  /// Begins with the cell as it is believed, the camera at T_mount_camera and the target at T_fixed_target.
  CellProblem(const CellInput& input, const CellSigmas& sigmas, const Pose& T_mount_camera, const Pose& T_fixed_target);
  /// Begins where another one ended.
  void begin_at(const CellProblem& other);
  CellGeometry cell(const CellGeometry& believed) const;

 private:
  void add_camera(const CellInput& input);
  void add_markers(const CellInput& input);
  void add_arm(const CellInput& input, const CellSigmas& sigmas);
  void add_scan(const CellScanInput& scan);
  void add_stop(const CellInput& input, std::size_t i, const CellSigmas& sigmas);
};

}  // namespace kr5::calibration::cell_calibration
