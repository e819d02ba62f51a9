// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/geometry/pose.hpp>

/// @file
/// Private: a measuring device and the point of the flange that it sees, found from where it saw that point.

namespace kr5::calibration {

struct DeviceFit {
  Pose T_device_base = Pose::Identity();
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();  ///< On the flange [m].
  double scale = 1.0;                             ///< Of the device's distances over the arm's [-].
  double scale_std = 0.0;                         ///< For residuals that are noise; 0 of a scale that is not free [-].
  Eigen::Matrix3Xd places;                        ///< Measured, in the base [m].
  double misfit = 0.0;                            ///< Median distance of places and tip [m].
};

/// Fits device and tip in turn; outliers count little. At least one place, all finite.
DeviceFit fit_device(const std::vector<Pose>& flanges, const Eigen::Matrix3Xd& places, bool free_scale = false);

/// Where the flanges put the tip in the base, 3 x n [m].
Eigen::Matrix3Xd tip_places(const std::vector<Pose>& flanges, const Eigen::Vector3d& tip);

}  // namespace kr5::calibration
