// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// The closed forms of OpenCV and ViSP, to start from and to compare with. They take poses of the target, not pixels,
/// know nothing of noise, and give no covariance; kr5::calibration::calibrate_hand_eye does.

namespace kr5::vision {

enum class HandEyeMethod { Tsai, Park, Horaud, Andreff, Daniilidis, Visp };

constexpr auto enum_names(HandEyeMethod) {
  return names<HandEyeMethod>({{HandEyeMethod::Tsai, "tsai"},
                               {HandEyeMethod::Park, "park"},
                               {HandEyeMethod::Horaud, "horaud"},
                               {HandEyeMethod::Andreff, "andreff"},
                               {HandEyeMethod::Daniilidis, "daniilidis"},
                               {HandEyeMethod::Visp, "visp"}});
}

/// One stop of the robot.
struct HandEyeSample {
  Pose T_base_flange = Pose::Identity();    ///< For a fixed camera: its inverse, T_flange_base.
  Pose T_camera_target = Pose::Identity();  ///< From the image.

  static void each_field(auto& self, auto&& visit) {
    visit("T_base_flange", self.T_base_flange, "Robot pose; for a fixed camera its inverse, T_flange_base.");
    visit("T_camera_target", self.T_camera_target, "Pose of the target in the camera.");
  }
};

/// T_flange_camera, or T_base_camera from inverted robot poses. What the library gives where the samples do not
/// determine the answer is returned as it is; it may be NaN. Beyond a quarter turn between samples OpenCV's tsai and
/// daniilidis can be wrong even on exact data. During `visp` the standard output of the process is closed, for ViSP
/// prints.
/// @throws InvalidArgument for fewer than three samples or NaN.
Pose closed_form_hand_eye(std::span<const HandEyeSample> samples, HandEyeMethod method);

}  // namespace kr5::vision
