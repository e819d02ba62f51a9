// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/geometry/pose.hpp>

/// @file
/// Another pose that explains the measurements of a calibration nearly as well as the one it found.

namespace kr5::calibration {

/// The second-best minimum of the cost of a calibration.
struct SecondMinimum {
  Pose T = Pose::Identity();
  double cost_ratio = 0.0;   ///< [-]
  double probability = 0.0;  ///< [-]
  double position = 0.0;     ///< [m]
  double rotation = 0.0;     ///< [rad]

  static void each_field(auto& self, auto&& visit) {
    visit("T", self.T, "The calibrated pose, as it would be there.");
    visit("cost_ratio", self.cost_ratio, "Robust sum of squared residuals there over that of the result [-].");
    visit("probability", self.probability,
          "Probability of being the right one of the two, for noise as it was found [-].");
    visit("position", self.position, "Distance from the result [m].");
    visit("rotation", self.rotation, "Angle from the result [rad].");
  }
};

}  // namespace kr5::calibration
