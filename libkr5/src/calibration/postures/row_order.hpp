// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/geometry/pose.hpp>

/// @file
/// Private: which measured place belongs to which posture.

namespace kr5::calibration {

struct RowOrder {
  std::vector<int> posture;  ///< Of each place.
  double misfit = 0.0;       ///< Median distance of places and tip with that [m].
};

/// The posture that each of as many places belongs to. Distances between places are those between flanges, but for the
/// tip, whatever the device: their sorted rows tell a posture by itself. Device, tip and order are then found in turn.
RowOrder match_rows(const std::vector<Pose>& flanges, const Eigen::Matrix3Xd& places);

}  // namespace kr5::calibration
