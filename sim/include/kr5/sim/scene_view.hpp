// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/predict/camera_scene.hpp>
#include <kr5/sim/line_scanner.hpp>

/// @file
/// Where an arm of a scene goes, and what camera and scanner make of it.

namespace kr5::sim {

/// One of the three.
struct WayPoint {
  Eigen::VectorXd q;  ///< [rad or m]
  std::optional<Pose> T_base_tool;
  std::optional<Pose> T_base_camera;

  static constexpr std::array<std::pair<std::string_view, std::string_view>, 2> file_keys = {
      {{"T_base_tool", "T_B_E"}, {"T_base_camera", "T_B_C"}}};
  static void each_field(auto& self, auto&& visit) {
    visit("q", self.q, "Joint values [rad or m]; one of the three fields is given.");
    visit("T_base_tool", self.T_base_tool, "Tool tip in the base [m, rad].");
    visit("T_base_camera", self.T_base_camera, "Camera in the base, with the nominal mount on the flange [m, rad].");
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
    visit("at", self.at, "Times of the pictures; empty: at the end of the rest at each way point [s].");
    visit("blur", self.blur, "Standard deviation of the lens blur [px].");
    visit("noise", self.noise, "Standard deviation of the camera noise [grey].");
    visit("background", self.background, "Grey of the background [grey, 0 to 255].");
    visit("clutter", self.clutter, "Standard deviation of a smooth random pattern on the background [grey].");
    visit("seed", self.seed, "Random seed of noise and clutter; each picture adds one.");
  }
};

/// When the scanner of the cell measures, and how.
struct SceneScan : LineScannerOptions {
  double begin = 0.0;         ///< [s]
  std::optional<double> end;  ///< [s]

  static void each_field(auto& self, auto&& visit) {
    visit("begin", self.begin, "Time of the first profile; one follows every cycle [s].");
    visit("end", self.end, "Time of the last profile; without it, the end of the scene [s].");
    LineScannerOptions::each_field(self, visit);
  }
};

/// Where a picture was taken from, and what was there.
struct ScenePicture {
  double t = 0.0;     ///< [s]
  Eigen::VectorXd q;  ///< [rad or m]
  Pose T_base_flange = Pose::Identity();
  predict::CameraScene scene;

  static void each_field(auto& self, auto&& visit) {
    visit("t", self.t, "Time of the picture [s].");
    visit("q", self.q, "Joint readings, without noise [rad or m].");
    visit("T_base_flange", self.T_base_flange, "Pose of the flange in the base [m, rad].");
    visit("scene", self.scene, "Scene before the camera, as drawn by kr5::vision::render.");
  }
};

}  // namespace kr5::sim
