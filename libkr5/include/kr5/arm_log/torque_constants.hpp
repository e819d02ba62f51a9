// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/cell/recording.hpp>

namespace kr5::arm_log {

/// Torque constants from a log of currents, on the joint side.
struct TorqueConstants {
  Eigen::VectorXd values;      ///< [N m/A or N/A]
  Eigen::VectorXd deviations;  ///< Standard deviations, for residuals as correlated as found [N m/A or N/A].

  /// The first joint (from 0) whose constant the log does not tell to be above zero; -1: none.
  int first_unknown() const;

  static void each_field(auto& self, auto&& visit) {
    visit("values", self.values, "Torque constant of each joint, on the joint side; 0: not found [N m/A or N/A].");
    visit("deviations", self.deviations, "Standard deviations of values [N m/A or N/A].");
  }
};

/// Torque constants of a model that states none, by the currents that its torques take in the motions to fit. Friction
/// and an offset stand beside them as far as the log shows any. Masses of the model that are all off by one factor
/// cannot be told from them. Empty where no motion to fit has currents.
/// @throws InvalidArgument as the fast simulator for a motion that it cannot predict.
TorqueConstants estimate_torque_constants(const cell::Recording& recording);

/// Whether a cell has drives whose torque constants are all 1, as a description of a robot makes them, which states
/// none.
bool lacks_torque_constants(const cell::Cell& cell);

}  // namespace kr5::arm_log
