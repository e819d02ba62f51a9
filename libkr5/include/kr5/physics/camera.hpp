// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>
#include <kr5/geometry/pinhole.hpp>

namespace kr5::physics {

/// Lens of the camera with the focal lengths that the effect replaces. Needs a camera.
Pinhole camera_focal(const cell::Cell& cell, Pinhole lens);
/// Lens of the camera with the radial distortion that the effect replaces.
Pinhole lens_distortion(const cell::Cell& cell, Pinhole lens);
/// Camera in what carries it, flange or base, with the mount that the effect replaces.
/// @throws InvalidArgument when the cell lacks the pose of the camera, or the camera is on the base with the effect.
Pose hand_eye(const cell::Cell& cell);

/// The camera of a cell with camera_focal, lens_distortion and hand_eye.
class EffectiveCamera {
 public:
  /// @throws InvalidArgument naming what is not there: camera, its mount.
  explicit EffectiveCamera(const cell::Cell& cell);

  const Pinhole& lens() const { return lens_; }
  /// T_base_camera for a pose of the flange.
  Pose T_base_camera(const Pose& T_base_flange) const { return on_flange_ ? T_base_flange * mount_ : mount_; }

 private:
  Pinhole lens_;
  bool on_flange_ = true;
  Pose mount_ = Pose::Identity();
};

}  // namespace kr5::physics
