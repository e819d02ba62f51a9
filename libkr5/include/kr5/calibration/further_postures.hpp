// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include <kr5/calibration/kinematics.hpp>
#include <kr5/core/fit_report.hpp>

/// @file
/// Errors of an identified arm on postures that took no part in the fit, beside those of the nominal arm.

namespace kr5::calibration {

constexpr int min_postures_to_place = 6;  ///< By which a device and the measured point are placed.

/// Distances of the measured places of further postures from where an arm puts them.
struct FurtherPostures {
  std::vector<double> errors;          ///< [m]
  std::vector<double> nominal_errors;  ///< [m]
  bool placed = false;
  double mean = 0.0;          ///< [m]
  double rms = 0.0;           ///< [m]
  double max = 0.0;           ///< [m]
  double nominal_mean = 0.0;  ///< [m]
  FitReport fit;

  static void each_field(auto& self, auto&& visit) {
    visit("errors", self.errors, "RMS distance of the measured from the predicted points of each posture [m].");
    visit("nominal_errors", self.nominal_errors, "The same of the nominal arm [m].");
    visit("placed", self.placed, "Whether device and measured point were placed on these postures.");
    visit("mean", self.mean, "Mean of the errors [m].");
    visit("rms", self.rms, "Their RMS [m].");
    visit("max", self.max, "Greatest of them [m].");
    visit("nominal_mean", self.nominal_mean, "Mean of the errors of the nominal arm [m].");
    visit("fit", self.fit, "Report of the fits that place both arms; not usable without errors.");
  }
};

/// Whether a fit does not say where the device of further postures, or the point that it measures, is: postures in
/// sockets tell nothing of a device, and poses tell nothing of a point.
bool need_placing(std::span<const ArmPosture> fitted, std::span<const ArmPosture> further);

/// Compares an identified and the nominal arm on further postures. Base and tool are those of the fit; the nominal arm
/// gets its own from the same postures, distances and options. What the fit does not say of them, both take from the
/// further postures.
///
/// An arm that cannot be placed gives FitStatus::Degenerate with the reason; then there are no errors.
/// @throws InvalidArgument for a result that is not usable or not of these postures, no further posture, one without a
/// measured place, or fewer than `min_postures_to_place` where they must be placed.
FurtherPostures evaluate_arm(const KinematicsResult& result, const kinematics::DhChain& nominal,
                             std::span<const ArmPosture> fitted, std::span<const ArmPosture> further,
                             std::span<const SocketDistance> distances = {}, const KinematicsOptions& options = {});

}  // namespace kr5::calibration
