// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/geometry/solid.hpp>
#include <kr5/geometry/target.hpp>

/// @file
/// Objects in front of a camera.

namespace kr5 {

/// A target in front of a camera.
struct PlacedTarget {
  Target target;
  Pose T_camera_target = Pose::Identity();

  static void each_field(auto& self, auto&& visit) {
    visit("target", self.target, "The target.");
    visit("T_camera_target", self.T_camera_target, "Pose in the camera.");
  }
};

/// A solid in front of a camera.
struct PlacedSolid {
  Solid solid;
  Pose T_camera_solid = Pose::Identity();

  static void each_field(auto& self, auto&& visit) {
    visit("solid", self.solid, "The solid.");
    visit("T_camera_solid", self.T_camera_solid, "Pose in the camera.");
  }
};

}  // namespace kr5
