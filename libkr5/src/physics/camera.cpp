// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/camera.hpp>

#include <kr5/core/error.hpp>

namespace kr5::physics {

Pinhole camera_focal(const cell::Cell& cell, Pinhole lens) {
  lens.fx = cell.effects.replaced_number("camera_focal", "fx").value_or(lens.fx);
  lens.fy = cell.effects.replaced_number("camera_focal", "fy").value_or(lens.fy);
  return lens;
}

Pinhole lens_distortion(const cell::Cell& cell, Pinhole lens) {
  lens.k1 = cell.effects.replaced_number("lens_distortion", "k1").value_or(lens.k1);
  lens.k2 = cell.effects.replaced_number("lens_distortion", "k2").value_or(lens.k2);
  return lens;
}

Pose hand_eye(const cell::Cell& cell) {
  const std::optional<Pose> replaced = cell.effects.replaced_pose("hand_eye", "T_E_C");
  const bool on_flange = cell.camera->mount == Mount::EyeInHand;
  require(on_flange || !replaced, "effects.hand_eye: only for a camera on the flange, this one is mounted on the base");
  const std::optional<Pose> mount = on_flange ? cell::T_flange_camera(cell) : cell.camera->T_base_camera;
  require(mount || replaced, on_flange ? "camera.T_E_C: is missing; expected the pose of the camera"
                                       : "camera.T_B_C: is missing; expected the pose of the camera");
  if (!replaced) return *mount;
  return cell.tool ? cell.tool->T_flange_tool * *replaced : *replaced;
}

EffectiveCamera::EffectiveCamera(const cell::Cell& cell) {
  require(cell.camera.has_value(), "camera: is missing in the cell");
  lens_ = lens_distortion(cell, camera_focal(cell, cell.camera->pinhole()));
  on_flange_ = cell.camera->mount == Mount::EyeInHand;
  mount_ = hand_eye(cell);
}

}  // namespace kr5::physics
