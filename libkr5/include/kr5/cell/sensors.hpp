// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/mount.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/io/reader.hpp>

namespace kr5::cell {

/// The lens. In a file the short form is the list k1 k2 p1 p2 k3, the general one `{model, values}`.
struct Distortion {
  LensModel model = LensModel::None;
  std::vector<double> values;  ///< [-]

  bool from_node(io::Reader& reader, const io::Node& node, const std::string& field);
  io::Node to_node() const;

  static void each_field(auto& self, auto&& visit) {
    visit("model", self.model, "Lens model: none | k1 | k1k2 | brown4 | brown5 | radial6 | rational8.");
    visit("values", self.values, "Coefficients in the order of the model, e.g. k1 k2 p1 p2 k3 for brown5 [-].");
  }
};

struct Camera {
  int width = 0, height = 0;                      ///< [px]
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  ///< [px]
  Distortion distortion;
  Mount mount = Mount::EyeInHand;
  std::optional<Pose> T_tool_camera;    ///< On the flange, given from the nominal tool tip; or
  std::optional<Pose> T_flange_camera;  ///< from the flange; or
  std::optional<Pose> T_base_camera;    ///< in the base. One of the three.

  Pinhole pinhole() const;
  /// Image size and intrinsics. The lens model stays where it holds the coefficients, else the least that does is
  /// taken.
  void set_pinhole(const Pinhole& lens);

  /// In a file the mount is `flange` or `base`.
  bool from_node(io::Reader& reader, const io::Node& node, const std::string& field);
  io::Node to_node() const;

  static constexpr std::array<std::pair<std::string_view, std::string_view>, 3> file_keys = {
      {{"T_tool_camera", "T_E_C"}, {"T_flange_camera", "T_F_C"}, {"T_base_camera", "T_B_C"}}};
  static constexpr std::array<std::string_view, 6> required = {"width", "height", "fx", "fy", "cx", "cy"};
  static void each_field(auto& self, auto&& visit) {
    Pinhole::each_intrinsic(self, visit);
    visit("distortion", self.distortion, "Lens model.");
    visit("mount", self.mount,
          "Part that carries the camera: eye_in_hand (the flange) | eye_to_hand (the base); in a cell file flange | "
          "base.");
    visit("T_tool_camera", self.T_tool_camera,
          "Camera in the nominal tool tip, which does not move with tool_offset [m, rad].");
    visit("T_flange_camera", self.T_flange_camera, "Camera in the flange [m, rad].");
    visit("T_base_camera", self.T_base_camera, "Camera in the base, for mount: base [m, rad].");
  }
};

/// What the line scanner looks at: a sphere on a plane.
struct ScannerTarget {
  Eigen::Vector3d sphere = Eigen::Vector3d::Zero();  ///< Centre in B [m].
  double radius = 0.0;                               ///< [m]
  double plane = 0.0;                                ///< z in B [m].

  static constexpr std::array<std::string_view, 3> required = {"sphere", "radius", "plane"};
  static void each_field(auto& self, auto&& visit) {
    visit("sphere", self.sphere, "Centre of the sphere in B [m].");
    visit("radius", self.radius, "Radius of the sphere [m].");
    visit("plane", self.plane, "Height z of the plane in B [m].");
  }
};

/// Line scanner: profile in its X-Z plane, Z away from the scanner.
struct LineScanner {
  std::optional<Pose> T_tool_scanner;    ///< From the nominal tool tip; or
  std::optional<Pose> T_flange_scanner;  ///< from the flange. One of the two.
  double stand_off = 0.19;               ///< Range without bias [m].
  double bias_distance = 0.05;           ///< Distance from there at which the bias is what laser_bias states [m].
  std::optional<ScannerTarget> target;

  static constexpr std::array<std::pair<std::string_view, std::string_view>, 2> file_keys = {
      {{"T_tool_scanner", "T_E_L"}, {"T_flange_scanner", "T_F_L"}}};
  static void each_field(auto& self, auto&& visit) {
    visit("T_tool_scanner", self.T_tool_scanner,
          "Scanner in the nominal tool tip, which does not move with tool_offset [m, rad].");
    visit("T_flange_scanner", self.T_flange_scanner, "Scanner in the flange [m, rad].");
    visit("stand_off", self.stand_off, "Best stand-off: range at which laser_bias is zero [m].");
    visit("bias_distance", self.bias_distance,
          "Distance from the stand-off at which the error is the stated bias of laser_bias [m].");
    visit("target", self.target, "Object that the scanner measures.");
  }
};

}  // namespace kr5::cell
