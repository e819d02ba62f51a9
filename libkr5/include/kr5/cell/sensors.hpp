// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/io/reader.hpp>

namespace kr5::cell {

/// The lens. In a file the short form is the list k1 k2 p1 p2 k3, the general one `{model, values}`.
struct Distortion {
  LensModel model = LensModel::None;
  std::vector<double> values;  ///< [-]

  bool read_form(io::Reader& reader, const io::Node& node, const std::string& field);
  io::Node write_form() const;

  static void each_field(auto& self, auto&& visit) {
    visit("model", self.model, "none | k1 | k1k2 | brown4 | brown5 | radial6 | rational8.");
    visit("values", self.values, "Coefficients in the order of the model, e.g. k1 k2 p1 p2 k3 for brown5 [-].");
  }
};

/// What carries the camera.
enum class CameraMount { Flange, Base };
constexpr auto enum_names(CameraMount) {
  return names<CameraMount>({{CameraMount::Flange, "flange"}, {CameraMount::Base, "base"}});
}

struct Camera {
  int width = 0, height = 0;                      ///< [px]
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  ///< [px]
  Distortion distortion;
  CameraMount mount = CameraMount::Flange;
  std::optional<Pose> T_E_C;  ///< On the flange, given from the nominal tool tip; or
  std::optional<Pose> T_F_C;  ///< from the flange; or
  std::optional<Pose> T_B_C;  ///< in the base. One of the three.

  Pinhole pinhole() const;

  static constexpr std::array<std::string_view, 6> required = {"width", "height", "fx", "fy", "cx", "cy"};
  static void each_field(auto& self, auto&& visit) {
    Pinhole::each_intrinsic(self, visit);
    visit("distortion", self.distortion, "Lens model.");
    visit("mount", self.mount, "flange | base: what carries the camera.");
    visit("T_E_C", self.T_E_C, "Camera in the nominal tool tip, which does not move with tool_offset [m, rad].");
    visit("T_F_C", self.T_F_C, "Camera in the flange [m, rad].");
    visit("T_B_C", self.T_B_C, "Camera in the base, for mount: base [m, rad].");
  }
};

/// What the line scanner looks at: a sphere on a plane.
struct LaserTarget {
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
struct Laser {
  std::optional<Pose> T_E_L;  ///< From the nominal tool tip; or
  std::optional<Pose> T_F_L;  ///< from the flange. One of the two.
  std::optional<LaserTarget> target;

  static void each_field(auto& self, auto&& visit) {
    visit("T_E_L", self.T_E_L, "Scanner in the nominal tool tip, which does not move with tool_offset [m, rad].");
    visit("T_F_L", self.T_F_L, "Scanner in the flange [m, rad].");
    visit("target", self.target, "What it looks at.");
  }
};

}  // namespace kr5::cell
