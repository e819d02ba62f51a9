// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <Eigen/Geometry>

/// @file
/// ViSP's vpServo, apart from all C++20: ViSP 3.5's headers are C++17.

namespace kr5::vision::detail {

/// ViSP's vpAdaptiveGain [1/s].
struct ServoGain {
  double far = 0, near = 0, slope = 0;
};

struct ServoTwist {
  Eigen::Matrix<double, 6, 1> twist = Eigen::Matrix<double, 6, 1>::Zero();  ///< Of the camera [m/s, rad/s].
  std::string failure;                                                      ///< Empty when there is one.
};

/// By place of the target in the camera and rotation vector of T_goal_camera.
ServoTwist visp_position_law(const Eigen::Isometry3d& T_camera_target, const Eigen::Isometry3d& T_camera_target_goal,
                             const ServoGain& gain);

/// By points of the image: rows x/z, y/z and depth z [m], seen and wished, a column a point.
ServoTwist visp_image_law(const Eigen::Matrix3Xd& seen, const Eigen::Matrix3Xd& wished, const ServoGain& gain);

}  // namespace kr5::vision::detail
