// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include <kr5/calibration/hand_eye.hpp>
#include <kr5/calibration/hand_eye_cause.hpp>
#include <kr5/calibration/hand_eye_pairs.hpp>
#include <kr5/calibration/pose_format.hpp>

/// @file
/// How good a hand-eye calibration is, and if it is bad, why. Every cause is a competing way of reading the same data,
/// fitted and compared with the sound reading by its likelihood, with a price for what it leaves free, and by its
/// error on views left out. Nothing is named that a sound set would show by chance more often than `false_alarm`.
/// The verdict follows from what a cause does to the answer, not from its being there.

namespace kr5::calibration {

/// What was recorded, before anything was concluded from it.
struct HandEyeRecording {
  Eigen::MatrixXd rows;       ///< One row of numbers per view, as the robot wrote them.
  PoseFormat format;          ///< How they are believed to be meant.
  std::vector<View> views;    ///< In the order taken.
  std::vector<double> times;  ///< Of the views [s]; empty: evenly spaced.
  Pinhole camera;
  Mount mount = Mount::EyeInHand;

  /// What `calibrate_hand_eye` took: its poses are the rows.
  static HandEyeRecording from_views(std::span<const HandEyeView> views, const Pinhole& camera,
                                     Mount mount = Mount::EyeInHand);

  /// @throws InvalidArgument when rows, views and times do not match.
  void validate() const;
};

/// The same of pairs of poses, without images.
struct HandEyePairsRecording {
  Eigen::MatrixXd rows;               ///< One row of numbers per pair, as the robot wrote them.
  PoseFormat format;                  ///< How they are believed to be meant.
  std::vector<Pose> T_camera_target;  ///< In the order taken.
  std::vector<std::string> names;     ///< Of the pairs; empty: their numbers.
  std::vector<double> times;          ///< Of the pairs [s]; empty: evenly spaced.
  Mount mount = Mount::EyeInHand;

  /// What `calibrate_hand_eye_pairs` took: its poses of the robot are the rows.
  static HandEyePairsRecording from_pairs(std::span<const PosePair> pairs, Mount mount = Mount::EyeInHand);

  /// @throws InvalidArgument when rows, poses, names and times do not match.
  void validate() const;
};

struct HandEyeDiagnosisOptions {
  double false_alarm = 0.02;      ///< [-]
  double tolerance = 0.002;       ///< [m]
  double working_distance = 0.0;  ///< [m]
  double min_rotation = 0.05;     ///< [rad]
  int seed = 1;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("false_alarm", self.false_alarm, "Rate of false causes on a sound data set [-].");
    visit("tolerance", self.tolerance, "Acceptable error at the tool (95 %) [m].");
    visit("working_distance", self.working_distance,
          "Distance in front of the camera at which the error is stated; 0: that of the target [m].");
    visit("min_rotation", self.min_rotation, "Minimum RMS rotation about the second axis [rad].");
    visit("seed", self.seed, "Random seed of the search for the order of the views.");
  }
};

enum class CalibrationVerdict {
  Good,      ///< The error (95 %) keeps the tolerance, and no cause moves the answer by more than that error.
  Doubtful,  ///< Anything between.
  Unusable,  ///< No answer, poses misread, an error (95 %) over 10 tolerances, or a cause that moves the answer by over
             ///< 5 of them and by more than the error stated.
};

constexpr auto enum_names(CalibrationVerdict) {
  return names<CalibrationVerdict>({{CalibrationVerdict::Good, "good"},
                                    {CalibrationVerdict::Doubtful, "doubtful"},
                                    {CalibrationVerdict::Unusable, "unusable"}});
}

struct HandEyeDiagnosis {
  CalibrationVerdict verdict = CalibrationVerdict::Unusable;
  std::string text;                ///< The verdict in plain words.
  std::vector<NamedCause> causes;  ///< Most probable first; empty for a sound set.
  double tool_error = 0.0;         ///< [m]
  double tool_error_95 = 0.0;      ///< [m]
  double working_distance = 0.0;   ///< [m]
  double held_out_rms = 0.0;       ///< [m]
  double rotation_major = 0.0;     ///< [rad]
  double rotation_minor = 0.0;     ///< [rad]

  static void each_field(auto& self, auto&& visit) {
    visit("verdict", self.verdict, "CalibrationVerdict: good | doubtful | unusable.");
    visit("text", self.text, "Text of the verdict.");
    visit("causes", self.causes, "Causes, most probable first; empty for a sound data set.");
    visit("tool_error", self.tool_error, "Expected (RMS) error of a point at the working distance [m].");
    visit("tool_error_95", self.tool_error_95, "Error of that point at 95 % [m].");
    visit("working_distance", self.working_distance,
          "Distance in front of the camera to which these errors refer [m].");
    visit("held_out_rms", self.held_out_rms, "RMS error of a point at the target's distance on held-out views [m].");
    visit("rotation_major", self.rotation_major, "RMS rotation of the wrist about its main axis [rad].");
    visit("rotation_minor", self.rotation_minor, "RMS rotation about the second axis; both are needed [rad].");
  }
};

/// Judges `result`, which `calibrate_hand_eye` gave for this recording, and looks for what is wrong with the recording.
/// @throws InvalidArgument for fewer than three views, or when rows, views and times do not match.
HandEyeDiagnosis diagnose_hand_eye(const HandEyeRecording& recording, const HandEyeResult& result,
                                   const HandEyeDiagnosisOptions& options = {});

/// The same for a result of `calibrate_hand_eye_pairs`. Beside the causes of an image set the target may be
/// mirrored; the camera's parameters are no cause. Inverted robot poses look the same as inverted camera poses.
/// @throws InvalidArgument for fewer than three pairs, or when rows, poses, names and times do not match.
HandEyeDiagnosis diagnose_hand_eye_pairs(const HandEyePairsRecording& recording, const HandEyeResult& result,
                                         const HandEyeDiagnosisOptions& options = {});

}  // namespace kr5::calibration
