// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include <kr5/calibration/hand_eye.hpp>

/// @file
/// Private: what poses alone tell, without noise model or iteration: how far they turn, and a first hand-eye.
/// Everything that refines starts here.

namespace kr5::calibration {

/// RMS turn of poses, relative to their mean, about their three principal axes, most first [rad].
Eigen::Vector3d principal_turns(std::span<const Pose> poses);

/// X = T_mount_camera and Z = T_fixed_target.
struct ClosedForm {
  Pose X = Pose::Identity(), Z = Pose::Identity();
  double scale = 1.0;  ///< Of the target; 1 unless it was left free [-].
};

/// Least squares of T X M = Z, T = T_base_flange (in hand) or its inverse (to hand), M = T_camera_target: the rotations
/// by the Kronecker product (Shah 2013), then the translations, with `free_scale` also the size of the target.
ClosedForm closed_form(std::span<const Pose> T_base_flange, std::span<const Pose> T_camera_target, Mount mount,
                       bool free_scale = false);

}  // namespace kr5::calibration
