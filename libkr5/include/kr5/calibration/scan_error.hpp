// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include <kr5/cell/cell.hpp>
#include <kr5/cell/simulator.hpp>
#include <kr5/core/fit_report.hpp>

/// @file
/// How far points of a scanner on the arm are off, by its stand-off and by its speed (Hayat et al. 2022, section 3.5).

namespace kr5::calibration {

struct ScanErrorOptions {
  double bias = 2e-4;   ///< [m]
  double delay = 6e-3;  ///< [s]
  int passes = 12;      ///< [-]
  int lines = 41;       ///< [-]
  int points = 181;     ///< [-]
  double width = 0.09;  ///< [m]
  std::uint64_t seed = 1;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("bias", self.bias, "Range error at the cell's bias_distance from the best stand-off [m].");
    visit("delay", self.delay, "Time by which the stamps of profiles are late [s].");
    visit("passes", self.passes, "Number of passes over the sphere, in directions evenly about the vertical.");
    visit("lines", self.lines, "Number of profiles of a pass.");
    visit("points", self.points, "Number of points of a profile.");
    visit("width", self.width, "Width of a profile [m].");
    visit("seed", self.seed, "Random seed of the noise of the ranges.");
  }
};

/// Error of a cloud of points on a sphere of known place.
struct ScanError {
  double rms = 0.0;     ///< [m]
  double centre = 0.0;  ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("rms", self.rms, "RMS distance of the points from the sphere [m].");
    visit("centre", self.centre,
          "Distance of the centre that the points show from the true one, RMS of all passes [m].");
  }
};

struct ScanErrorResult {
  ScanError as_stamped;
  ScanError synchronised;
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("as_stamped", self.as_stamped, "Error with the poses at the stamps of the profiles.");
    visit("synchronised", self.synchronised, "Error with the poses interpolated at the times of the profiles.");
    visit("fit", self.fit,
          "Report on the fits of the sphere; degenerate, without errors, when a pass does not show it.");
  }
};

/// Simulates passes over the sphere of the cell's scanner, which looks straight down and moves along its own Y. The
/// ranges have the effects of the cell with the bias and the delay of the options, and the noise of the cell; the cloud
/// is made with the nominal arm and scanner. The noise is drawn alike for every stand-off and speed, so that two
/// answers differ by these alone.
/// @param stand_off Range of the top of the sphere [m]. @param speed Of the scanner [m/s].
/// @throws InvalidArgument for a cell without laser, target, mount or limits of the arm, an invalid option, or a pass
/// that the arm does not reach.
ScanErrorResult simulate_scan_error(const cell::Cell& cell, const cell::Simulator& simulator, double stand_off,
                                    double speed, const ScanErrorOptions& options = {});

}  // namespace kr5::calibration
