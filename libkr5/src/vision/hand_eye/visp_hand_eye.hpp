// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

/// @file
/// Private: ViSP's hand-eye solver behind a C++17 border, which its headers need.

namespace kr5::vision {

/// T_flange_camera from poses of the target in the camera and of the flange in the base.
Eigen::Matrix4d visp_hand_eye(const std::vector<Eigen::Matrix4d>& T_camera_target,
                              const std::vector<Eigen::Matrix4d>& T_base_flange);

}  // namespace kr5::vision
