// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Geometry>

/// @file
/// vpCalibration, apart from all C++20: ViSP 3.5's headers are C++17.

namespace kr5::vision::detail {

struct VispCamera {
  double px = 0, py = 0, u0 = 0, v0 = 0, kud = 0;
  std::vector<Eigen::Isometry3d> poses;  ///< T_camera_target
  std::string failure;                   ///< Empty when it converged.
};

/// `start` holds px py u0 v0; points [m] and pixels [px] of each view, one column a point.
VispCamera visp_camera(const std::vector<Eigen::Matrix3Xd>& points, const std::vector<Eigen::Matrix2Xd>& pixels,
                       const VispCamera& start, bool distorted);

}  // namespace kr5::vision::detail
