// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include <kr5/calibration/kinematics.hpp>

/// @file
/// Whether the camera and the target of a cell stand where a kinematic calibration puts them.

namespace kr5::calibration {

struct CameraAgreement {
  bool believed = true;
  double squared_distance = 0.0;  ///< [-]
  int dof = 0;
  double limit = 0.0;  ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("believed", self.believed, "Whether the stated poses lie within the limit.");
    visit("squared_distance", self.squared_distance,
          "Squared distance of the stated poses from the estimated ones, in their covariance: a chi-square [-].");
    visit("dof", self.dof, "Its degrees of freedom: six for each pose that was estimated.");
    visit("limit", self.limit, "Value that right poses exceed with the probability of a false alarm [-].");
  }
};

/// Compares T_flange_camera and T_base_target of the options with what a calibration found in which both were free;
/// empty where it is not usable or neither was estimated.
/// @throws InvalidArgument for a false alarm outside (0, 1).
std::optional<CameraAgreement> camera_agreement(const KinematicsResult& found, const KinematicsOptions& stated,
                                                double false_alarm = 1e-3);

}  // namespace kr5::calibration
