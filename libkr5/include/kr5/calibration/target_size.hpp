// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <kr5/calibration/pose_convention.hpp>

/// @file
/// The size of a target of which nothing tells it, from the robot poses at which it was seen: a camera alone sees no
/// scale.

namespace kr5::calibration {

/// The size that the poses tell, and the readings of the poses under it.
struct TargetSize {
  double factor = 1.0;                      ///< [-]
  std::vector<PoseConvention> conventions;  ///< The best first.

  static void each_field(auto& self, auto&& visit) {
    visit("factor", self.factor, "Size of the target over the one that was stated [-].");
    visit("conventions", self.conventions,
          "Readings of the poses with the target in this size, the one under which robot and camera agree best first.");
  }
};

/// The size with which robot and camera agree best, of those that the first three conventions tell: with a wrong size
/// the true one may not be the first. Nothing when no size agrees better than the stated one.
/// @param conventions As rank_conventions() gives them for the stated size.
/// @throws InvalidArgument for a view of a row that is not there, a convention of a rotation that no reading has, and
///         as `calibrate_hand_eye`.
std::optional<TargetSize> size_from_poses(const std::vector<PoseRows>& readings, const std::vector<ViewOfPose>& views,
                                          const Pinhole& camera, std::span<const PoseConvention> conventions);

}  // namespace kr5::calibration
