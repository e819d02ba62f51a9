// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/calibration/hand_eye.hpp>
#include <kr5/calibration/pose_format.hpp>

/// @file
/// The convention of robot poses of which nothing tells it, from what a camera saw at them.

namespace kr5::calibration {

/// Rows of robot poses, read in one form of rotation.
struct PoseRows {
  RotationForm rotation = RotationForm::QuaternionXyzw;
  Eigen::MatrixXd rows;

  static void each_field(auto& self, auto&& visit) {
    visit("rotation", self.rotation, "Form of the rotation in which they were read.");
    visit("rows", self.rows, "Numbers of each pose.");
  }
};

/// A view of the target at one of the poses.
struct ViewOfPose {
  int pose = 0;
  View view;

  static void each_field(auto& self, auto&& visit) {
    visit("pose", self.pose, "Row of the pose, from 0.");
    visit("view", self.view, "Target points and their pixels.");
  }
};

/// A reading of the poses, and how well robot and camera agree under it.
struct PoseConvention {
  PoseFormat format;
  Mount mount = Mount::EyeInHand;
  double error = 0.0;  ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("format", self.format, "Convention of the rows, of meaning T_base_flange.");
    visit("mount", self.mount, "Mount of the camera.");
    visit("error", self.error,
          "Median error of the robot that would explain a view: position, and rotation at half a metre [m].");
  }
};

/// Every reading of the poses with which a hand-eye calibration succeeds, the one under which robot and camera agree
/// best first. Poses that two readings share are tried once. Inverted poses with the other mount agree equally well, so
/// that the meaning is T_base_flange here.
/// @throws InvalidArgument for a view of a row that is not there, and as `to_poses`.
std::vector<PoseConvention> rank_conventions(const std::vector<PoseRows>& readings,
                                             const std::vector<ViewOfPose>& views, const Pinhole& camera);

}  // namespace kr5::calibration
