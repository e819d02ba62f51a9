// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/cell/placed_object.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/placed.hpp>

namespace kr5::predict {

/// What the camera of a cell has before it, with the effects on lens, mount and tube.
struct CameraScene {
  Pinhole lens;
  Pose T_base_camera = Pose::Identity();
  std::vector<std::string> names;     ///< Of the targets.
  std::vector<PlacedTarget> targets;  ///< Board and targets of the cell.
  std::vector<PlacedSolid> solids;    ///< Its tube and the scanner's sphere, then the objects given.

  static void each_field(auto& self, auto&& visit) {
    visit("lens", self.lens, "Lens with the effects that the cell carries.");
    visit("T_base_camera", self.T_base_camera, "Pose of the camera in the base [m, rad].");
    visit("names", self.names, "Names of the targets.");
    visit("targets", self.targets, "Board and targets of the cell, in the camera.");
    visit("solids", self.solids, "Tube, sphere of the scanner and other objects, in the camera.");
  }
};

/// The scene of the camera for a pose of the flange.
/// @param objects Solids that stand in the cell beside its own.
/// @throws InvalidArgument as physics::EffectiveCamera.
CameraScene camera_scene(const cell::Cell& cell, const Pose& T_base_flange,
                         const std::vector<cell::PlacedObject>& objects = {});

}  // namespace kr5::predict
