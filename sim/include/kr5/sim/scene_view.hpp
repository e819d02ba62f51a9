// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/predict/sight.hpp>
#include <kr5/sim/line_scanner.hpp>

/// @file
/// Where an arm of a scene goes, and what camera and scanner make of it.

namespace kr5::sim {

/// One of the three.
struct WayPoint {
  Eigen::VectorXd q;  ///< [rad or m]
  std::optional<Pose> T_B_E;
  std::optional<Pose> T_B_C;

  static void each_field(auto& self, auto&& visit) {
    visit("q", self.q, "Joint values [rad or m]; or");
    visit("T_B_E", self.T_B_E, "the tool tip in the base [m, rad]; or");
    visit("T_B_C", self.T_B_C, "the camera in the base, as the cell believes it sits on the flange [m, rad].");
  }
};

/// Pictures that the camera of the cell takes.
struct ScenePictures {
  Eigen::VectorXd at;         ///< [s]
  double blur = 0.6;          ///< [px]
  double noise = 1.5;         ///< [grey]
  double background = 110.0;  ///< [grey]
  double clutter = 0.0;       ///< [grey]
  int seed = 1;

  static void each_field(auto& self, auto&& visit) {
    visit("at", self.at, "When; empty: at the end of the rest at each way point [s].");
    visit("blur", self.blur, "Standard deviation of the lens blur [px].");
    visit("noise", self.noise, "Standard deviation of the camera noise [grey].");
    visit("background", self.background, "Grey of what is no object [grey, 0 to 255].");
    visit("clutter", self.clutter, "Standard deviation of a smooth random pattern on it [grey].");
    visit("seed", self.seed, "Of noise and clutter, one more each picture.");
  }
};

/// When the scanner of the cell measures, and how.
struct SceneScan : LineScannerOptions {
  double from = 0.0;         ///< [s]
  std::optional<double> to;  ///< [s]

  static void each_field(auto& self, auto&& visit) {
    visit("from", self.from, "First profile; then one every cycle [s].");
    visit("to", self.to, "Last profile; none: the end of the scene [s].");
    LineScannerOptions::each_field(self, visit);
  }
};

/// Where a picture was taken from, and what was there.
struct ScenePicture {
  double t = 0.0;     ///< [s]
  Eigen::VectorXd q;  ///< [rad or m]
  Pose T_B_F = Pose::Identity();
  predict::Sight sight;

  static void each_field(auto& self, auto&& visit) {
    visit("t", self.t, "When [s].");
    visit("q", self.q, "What the encoders told, noise apart [rad or m].");
    visit("T_B_F", self.T_B_F, "Where the flange really was.");
    visit("sight", self.sight, "What the camera had before it, as it really was: for kr5::vision::render.");
  }
};

}  // namespace kr5::sim
