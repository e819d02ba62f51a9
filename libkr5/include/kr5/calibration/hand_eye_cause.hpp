// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// Faults of a hand-eye recording, and how they are reported.

namespace kr5::calibration {

enum class HandEyeCause {
  TooLittleRotation,
  OneAxisRotation,
  PosesInverted,
  WrongRotationForm,
  QuaternionOrder,
  DegreesForRadians,
  MillimetresForMetres,
  TargetSizeWrong,
  OutOfOrder,
  ShiftedByOne,
  TargetMoved,
  ClockOffset,
  CameraModelWrong,
  OutlierViews,
  MirroredTarget,
};

constexpr auto enum_names(HandEyeCause) {
  using enum HandEyeCause;
  return names<HandEyeCause>({{TooLittleRotation, "too_little_rotation"},
                              {OneAxisRotation, "one_axis_rotation"},
                              {PosesInverted, "poses_inverted"},
                              {WrongRotationForm, "wrong_rotation_form"},
                              {QuaternionOrder, "quaternion_order"},
                              {DegreesForRadians, "degrees_for_radians"},
                              {MillimetresForMetres, "millimetres_for_metres"},
                              {TargetSizeWrong, "target_size_wrong"},
                              {OutOfOrder, "out_of_order"},
                              {ShiftedByOne, "shifted_by_one"},
                              {TargetMoved, "target_moved"},
                              {ClockOffset, "clock_offset"},
                              {CameraModelWrong, "camera_model_wrong"},
                              {OutlierViews, "outlier_views"},
                              {MirroredTarget, "mirrored_target"}});
}

/// One cause, with what speaks for it.
struct NamedCause {
  HandEyeCause cause = HandEyeCause::OutlierViews;
  double probability = 0.0;  ///< [-]
  std::string text;          ///< What is wrong.
  std::string evidence;
  std::string remedy;
  double value = 0.0;  ///< Its size, in `unit`.
  std::string unit;
  double consequence = 0.0;      ///< [m]
  double held_out_before = 0.0;  ///< [m]
  double held_out_after = 0.0;   ///< [m]
  std::vector<int> views;        ///< Those concerned, from 0.
  /// With the cause corrected, by a fit to the poses of the target alone; absent when it cannot be.
  std::optional<Pose> T_mount_camera;
  Matrix6 covariance = Matrix6::Zero();  ///< Of T_mount_camera, right perturbation [m, rad].

  static void each_field(auto& self, auto&& visit) {
    visit("cause", self.cause, "Identifier of the cause.");
    visit("probability", self.probability, "Probability of this cause among all that were tested [-].");
    visit("text", self.text, "Description of the fault.");
    visit("evidence", self.evidence, "Evidence for it.");
    visit("remedy", self.remedy, "Recommended action.");
    visit("value", self.value, "Size of the fault, in `unit`.");
    visit("unit", self.unit, "Unit of `value`.");
    visit("consequence", self.consequence,
          "Displacement of a point at the working distance when the cause is corrected; 0 when it cannot be [m].");
    visit("held_out_before", self.held_out_before,
          "RMS error of a point at the target's distance on held-out views, as recorded [m].");
    visit("held_out_after", self.held_out_after, "RMS error of the same point with this cause corrected [m].");
    visit("views", self.views, "Views concerned, from 0.");
    visit("T_mount_camera", self.T_mount_camera,
          "Pose of the camera with the cause corrected, by a fit to the poses of the target alone; absent when it "
          "cannot be.");
    visit("covariance", self.covariance,
          covariance_doc("T_mount_camera", "Covariance of T_mount_camera, right perturbation [m, rad]."));
  }
};

}  // namespace kr5::calibration
