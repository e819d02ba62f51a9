// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include <kr5/calibration/hand_eye_pairs.hpp>

/// @file
/// Which way round the poses of a pair are: T_base_flange or its inverse, T_camera_target or its inverse.

namespace kr5::calibration {

/// One way of reading pairs of poses: as given, or with poses inverted.
struct PairReading {
  bool robot_inverted = false;
  bool camera_inverted = false;
  double sigma_position = 0.0;   ///< [m]
  double sigma_rotation = 0.0;   ///< [rad]
  double score = 0.0;            ///< [-]
  double flange_distance = 0.0;  ///< [m]
  double base_distance = 0.0;    ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("robot_inverted", self.robot_inverted, "True when the robot poses are read as T_flange_base.");
    visit("camera_inverted", self.camera_inverted, "True when the camera poses are read as T_target_camera.");
    visit("sigma_position", self.sigma_position, "Disagreement of robot and camera in position per axis [m].");
    visit("sigma_rotation", self.sigma_rotation, "Disagreement of robot and camera in orientation per axis [rad].");
    visit("score", self.score, "-2 log likelihood of the poses, without its constant [-].");
    visit("flange_distance", self.flange_distance,
          "Distance from the flange of what it carries: camera (in hand) or target (to hand) [m].");
    visit("base_distance", self.base_distance, "Distance from the base of what stands still [m].");
  }
};

/// Which way round poses are.
struct PairReadings {
  std::vector<PairReading> readings;
  bool certain = false;
  std::string text;

  static void each_field(auto& self, auto&& visit) {
    visit("readings", self.readings,
          "Readings, the most likely first; of two that agree equally, the one as given, else the one with the shorter "
          "distance from the flange.");
    visit("certain", self.certain,
          "Whether the data show that one list is inverted against the other: otherwise robot and camera disagree at "
          "least twice as much, and more than chance allows.");
    visit("text", self.text, "Result in words.");
  }
};

/// Compares the four ways round of reading pairs.
///
/// T X M = Z also says M' X' T' = Z' of the inverses, and T' Z M' = X: pairs tell whether one list is inverted
/// against the other, but not which of the two, nor whether both are, nor robot and camera exchanged, nor the mount.
/// What tells these apart is where camera and target come to lie: see the distances.
/// @throws InvalidArgument for fewer than three pairs, or a pose that is not finite or not proper.
PairReadings compare_pair_readings(std::span<const PosePair> pairs, Mount mount);

/// The pairs in one reading.
std::vector<PosePair> read_pairs(std::span<const PosePair> pairs, const PairReading& reading);

}  // namespace kr5::calibration
