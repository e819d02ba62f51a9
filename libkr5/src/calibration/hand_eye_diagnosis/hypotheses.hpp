// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/calibration/hand_eye_diagnosis.hpp>

#include "calibration/hand_eye_diagnosis/reading_fit.hpp"

/// @file
/// The competing readings of a recording. Each function fits one family and returns its candidates.

namespace kr5::calibration::evidence {

/// A fitted reading beside the sound one.
struct SetupHypothesis {
  std::vector<HandEyeCause> causes;  ///< Empty: sound.
  Reading reading;
  ReadingFit fit;
  double score = 0.0;      ///< -2 log likelihood of the recording, comparable between hypotheses.
  int freedom = 0;         ///< Continuous parameters beyond the sound reading's.
  double choices = 1.0;    ///< log of how many readings of the kind were tried.
  double value = 0.0;      ///< Size of the fault.
  std::vector<int> views;  ///< Those concerned.
  Pinhole camera;          ///< Of a camera hypothesis.
  PoseFormat format;       ///< Of a format hypothesis.
};

/// What all families look at.
struct Case {
  const HandEyeRecording& recording;
  Sightings sightings;
  std::vector<Pose> poses;  ///< Of every view, seen or not.
  SetupHypothesis sound;
  bool pairs =
      false;  ///< Poses of the target were given, not images: behind the sightings stand the same, read otherwise.
};

/// Sightings from poses of the target; behind them stand the same mirrored.
Sightings given_sightings(const std::vector<Pose>& T_camera_target);

/// Pairs every sighting with the pose of its own view.
Reading as_recorded(const Case& c, const std::vector<Pose>& poses);

std::vector<SetupHypothesis> other_formats(const Case& c);
std::vector<SetupHypothesis> mirrored_target(const Case& c);
std::vector<SetupHypothesis> other_size(const Case& c);
std::vector<SetupHypothesis> shifted_readings(const Case& c);
std::vector<SetupHypothesis> moved_target(const Case& c);
std::vector<SetupHypothesis> outlier_readings(const Case& c);
}  // namespace kr5::calibration::evidence
