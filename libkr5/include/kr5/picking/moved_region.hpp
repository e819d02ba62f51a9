// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/picking/cloud.hpp>
#include <kr5/picking/disturbance.hpp>
#include <kr5/picking/pellets.hpp>

/// @file
/// A cloud, and the cylinders found in it, without what moved in the image since (Hayat et al. 2022, section 2.4.1).

namespace kr5::picking {

/// A cloud from which what moved has been taken.
struct PrunedCloud {
  Cloud cloud;
  int removed = 0;
  int unseen = 0;

  static void each_field(auto& self, auto&& visit) {
    visit("cloud", self.cloud, "The cloud; a column of NaN where a point was taken out.");
    visit("removed", self.removed, "Number of points taken out.");
    visit("unseen", self.unseen, "Number of points outside the image, about which it says nothing; they stay.");
  }
};

/// Takes out of a cloud the points that project into changed pixels, or would if moved by up to `margin` [m]: the
/// error of scanner, camera and their poses. @throws InvalidArgument for a mask that is not of the size of the camera's
/// image, an invalid cloud or camera, a pose that is no rigid motion, or a negative margin.
PrunedCloud remove_changed(const Cloud& cloud, const PixelMask& changed, const Pinhole& camera,
                           const Pose& T_camera_base, double margin = 0.002);

/// Which cylinders show, somewhere on the surface that faces the camera, a changed pixel within `margin` [m]; their
/// numbers in the list. One outside the image is not listed. @throws InvalidArgument as remove_changed.
std::vector<int> disturbed_pellets(const std::vector<Pellet>& pellets, const PixelMask& changed, const Pinhole& camera,
                                   const Pose& T_camera_base, double margin = 0.002);

}  // namespace kr5::picking
