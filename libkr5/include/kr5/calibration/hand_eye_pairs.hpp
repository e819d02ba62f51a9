// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include <kr5/calibration/hand_eye.hpp>

/// @file
/// Hand-eye calibration from pairs of poses, without images: where the flange stood and where the camera saw the
/// target, as MoveIt, easy_handeye, a tracker or a vision system of one's own records them.

namespace kr5::calibration {

/// One robot stop with the pose in which the target was seen from it.
struct PosePair {
  std::string name;
  Pose T_base_flange = Pose::Identity();
  Pose T_camera_target = Pose::Identity();

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the pair.");
    visit("T_base_flange", self.T_base_flange, "Pose of the flange in the base, from the robot controller.");
    visit("T_camera_target", self.T_camera_target, "Pose of the target in the camera, as it was seen.");
  }
};

struct HandEyePairsOptions {
  Mount mount = Mount::EyeInHand;
  double sigma_position = 0.0;         ///< [m]
  double sigma_robot_rotation = 0.0;   ///< [rad]
  double sigma_camera_rotation = 0.0;  ///< [rad]
  double min_rotation = 0.1;           ///< [rad]
  double outlier_false_alarm = 0.01;   ///< [-]
  int max_iterations = 100;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("mount", self.mount, "Mount of the camera: eye_in_hand (on the flange) | eye_to_hand (fixed in the base).");
    visit("sigma_position", self.sigma_position,
          "Noise of a position per axis, of robot and camera together, which no data can separate [m]; 0: estimated "
          "from the data.");
    visit("sigma_robot_rotation", self.sigma_robot_rotation,
          "Noise of a robot orientation per axis [rad]; 0: estimated from the data.");
    visit("sigma_camera_rotation", self.sigma_camera_rotation,
          "Noise of a seen orientation of the target per axis [rad]; 0: estimated from the data.");
    visit("min_rotation", self.min_rotation, "Minimum rotation of the wrist, about two axes, for a calibration [rad].");
    visit("outlier_false_alarm", self.outlier_false_alarm,
          "Probability of a false outlier in sound data, over all pairs [-].");
    visit("max_iterations", self.max_iterations, "Maximum number of iterations of one fit.");
  }
};

/// Estimates camera and target pose together from pairs of poses (fit::Problem), both with their noise.
///
/// Position noise, rotation noise of the robot (about the flange) and of the camera (about the target) are estimated by
/// restricted maximum likelihood unless given, and the covariances are widened for their uncertainty, as in
/// calibrate_hand_eye. Pairs that contradict the others are left out and named; at least six in ten stay. In the result
/// `sigma_robot_position` is the noise of robot and camera together, `sigma_pixel` is 0, and views have no `rms_px`.
///
/// Data that cannot determine the answer give `fit.status == FitStatus::Degenerate` and the reason in `fit.message`.
/// @throws InvalidArgument for fewer than three pairs, a pair given twice, a pose that is not finite or not proper, or
///         invalid options.
HandEyeResult calibrate_hand_eye_pairs(std::span<const PosePair> pairs, const HandEyePairsOptions& options = {});

}  // namespace kr5::calibration
