// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <kr5/calibration/hand_eye.hpp>
#include <kr5/calibration/hand_eye_pairs.hpp>

/// @file
/// Error of a hand-eye method on held-out views. All methods are evaluated in the same way: a solver does not
/// grade itself.

namespace kr5::calibration {

struct EvaluateOptions {
  Mount mount = Mount::EyeInHand;
  int folds = 0;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("mount", self.mount, "Mount of the camera: eye_in_hand (on the flange) | eye_to_hand (fixed in the base).");
    visit("folds", self.folds,
          "Number of groups left out in turn, view i in group i modulo folds; 0: each view alone.");
  }
};

/// One view, predicted from a calibration made without it.
struct HeldOutView {
  std::string name;
  double position = 0.0;  ///< [m]
  double rotation = 0.0;  ///< [rad]
  double rms_px = 0.0;    ///< [px]

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name of the view.");
    visit("position", self.position, "Distance of the target's origin as seen and as predicted [m].");
    visit("rotation", self.rotation, "Angle between the target as seen and as predicted [rad].");
    visit("rms_px", self.rms_px, "RMS distance of seen and predicted points [px].");
  }
};

struct HandEyeEvaluation {
  std::vector<HeldOutView> views;
  double position_rms = 0.0;     ///< [m]
  double rotation_rms = 0.0;     ///< [rad]
  double position_median = 0.0;  ///< [m]
  double rotation_median = 0.0;  ///< [rad]
  int unjudged = 0;

  static void each_field(auto& self, auto&& visit) {
    visit("views", self.views, "Evaluated views, in input order.");
    visit("position_rms", self.position_rms, "RMS position error over the views [m].");
    visit("rotation_rms", self.rotation_rms, "RMS rotation error over the views [rad].");
    visit("position_median", self.position_median, "Median position error over the views [m].");
    visit("rotation_median", self.rotation_median, "Median rotation error over the views [rad].");
    visit("unjudged", self.unjudged,
          "Number of views that could not be evaluated: without a pose of the target, or without a calibration from "
          "the rest.");
  }
};

/// What a method returns: without T_fixed_target, the mean of what T_mount_camera makes of the views is taken.
struct HandEyePoses {
  Pose T_mount_camera = Pose::Identity();
  std::optional<Pose> T_fixed_target;
};

/// A method under test: from views and the poses of the target seen in them (T_camera_target); empty when it gives
/// none.
using HandEyeSolver = std::function<std::optional<HandEyePoses>(std::span<const HandEyeView>, std::span<const Pose>)>;

/// Judges a method on views left out. Where a plane allows two poses of a held-out target, the one nearer to the
/// prediction counts, for every method alike.
/// @throws InvalidArgument for fewer than four views, a view with fewer than four points, or NaN.
HandEyeEvaluation evaluate_hand_eye(std::span<const HandEyeView> views, const Pinhole& camera,
                                    const HandEyeSolver& solver, const EvaluateOptions& options = {});

/// The same for calibrate_hand_eye; the mount is that of `calibration`.
HandEyeEvaluation evaluate_hand_eye(std::span<const HandEyeView> views, const Pinhole& camera,
                                    const HandEyeOptions& calibration, int folds = 0);

/// The same for calibrate_hand_eye_pairs: the pose of the target as seen and as predicted; without images there is no
/// `rms_px`. Pairs without a calibration from the rest are not judged.
/// @throws InvalidArgument for fewer than four pairs, or invalid options.
HandEyeEvaluation evaluate_hand_eye_pairs(std::span<const PosePair> pairs, const HandEyePairsOptions& calibration,
                                          int folds = 0);

}  // namespace kr5::calibration
