// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <span>

#include <kr5/core/fields.hpp>
#include <kr5/identification/dynamics_model.hpp>
#include <kr5/identification/joint_log.hpp>
#include <kr5/identification/log_conditioning.hpp>

/// @file
/// Whether torques are fitted as they were logged, or low-passed as the positions are. Smoothing takes noise away, and
/// rounds off the steps of dry friction.

namespace kr5::identification {

/// The choice, with how well each way predicts the torques of the part that was left out, as they were logged.
struct TorqueSmoothing {
  bool smooth = true;
  double error_smoothed = std::numeric_limits<double>::infinity();  ///< [-]
  double error_logged = std::numeric_limits<double>::infinity();    ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("smooth", self.smooth, "Torques low-passed as the positions are.");
    visit("error_smoothed", self.error_smoothed,
          "Norm of all errors over the norm of all torques of the part left out, fitted to smoothed torques; infinite "
          "where they tell no dynamics [-].");
    visit("error_logged", self.error_logged, "The same, fitted to torques as they were logged [-].");
  }
};

/// Fits the first two thirds of each log in both ways, and takes torques as they were logged where the last thirds are
/// then predicted better by more than a twentieth. By the usual estimator, whose choice of terms would take longer than
/// the fit. `options.smooth_torques` is not read.
/// @throws InvalidArgument for sizes that differ in a log; a log that cannot be used is an infinite error.
TorqueSmoothing choose_torque_smoothing(std::span<const JointLog> logs, const ConditioningOptions& options,
                                        const DynamicsModel& model);

}  // namespace kr5::identification
