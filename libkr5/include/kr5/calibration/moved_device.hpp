// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>

#include <kr5/calibration/kinematics.hpp>

/// @file
/// Whether the measuring device, or the base of the arm, moved while postures were measured.

namespace kr5::calibration {

/// A posture from which on all measured places are elsewhere.
struct MovedDevice {
  int row = 0;
  Eigen::Vector3d jump = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d std = Eigen::Vector3d::Zero();   ///< [m]
  double chi_square = 0.0;                         ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("row", self.row, "First posture after the jump, from 0.");
    visit("jump", self.jump, "Jump of the residuals of the places there, in the frame of the device [m].");
    visit("std", self.std, "Its standard deviation per axis [m].");
    visit("chi_square", self.chi_square,
          "Squared distance of the residuals before from those after, outliers apart; three degrees of freedom [-].");
  }
};

/// Searches the residuals of a calibration (of the tool, or of the first point that was seen) for the row from which on
/// they differ most from those before. Outliers count little. Fewer than twelve places tell nothing.
/// @param max_chi_square Greatest chi-square, over all rows, that chance gives [-].
/// @throws InvalidArgument for postures that do not fit the result, or a `max_chi_square` that is not positive.
std::optional<MovedDevice> find_moved_device(const KinematicsResult& result, std::span<const ArmPosture> postures,
                                             double max_chi_square = 60.0);

}  // namespace kr5::calibration
