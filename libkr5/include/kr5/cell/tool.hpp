// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string_view>
#include <utility>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>

namespace kr5::cell {

/// What the flange carries. The default is a bare flange without mass, its tip and sensor in the flange.
struct Tool {
  Pose T_flange_tool = Pose::Identity();          ///< Tool tip (peg-bottom centre).
  Pose T_flange_sensor = Pose::Identity();        ///< Force/torque sensor.
  double mass = 0.0;                              ///< [kg]
  Eigen::Vector3d com = Eigen::Vector3d::Zero();  ///< In S [m].
  Vector6 inertia = Vector6::Zero();              ///< Ixx Iyy Izz Ixy Ixz Iyz about the com, axes of S [kg m^2].

  /// The symmetric 3x3 matrix [kg m^2].
  Eigen::Matrix3d inertia_matrix() const;

  static constexpr std::array<std::pair<std::string_view, std::string_view>, 2> file_keys = {
      {{"T_flange_tool", "T_F_E"}, {"T_flange_sensor", "T_F_S"}}};
  static constexpr std::array<std::string_view, 1> required = {"T_F_E"};
  static void each_field(auto& self, auto&& visit) {
    visit("T_flange_tool", self.T_flange_tool, "Tool tip (peg-bottom centre) in the flange [m, rad].");
    visit("T_flange_sensor", self.T_flange_sensor, "Force/torque sensor in the flange [m, rad].");
    visit("mass", self.mass, "Mass of everything below the sensor [kg].");
    visit("com", self.com, "Centre of mass of it in S [m].");
    visit("inertia", self.inertia, "Inertia Ixx Iyy Izz Ixy Ixz Iyz about the centre of mass, axes of S [kg m^2].");
  }
};

/// The part that is inserted, round, along Z of E.
struct Peg {
  double radius = 0.0;   ///< [m]
  double length = 0.0;   ///< [m]
  double chamfer = 0.0;  ///< [m]

  static constexpr std::array<std::string_view, 2> required = {"radius", "length"};
  static void each_field(auto& self, auto&& visit) {
    visit("radius", self.radius, "Radius [m].");
    visit("length", self.length, "Length [m].");
    visit("chamfer", self.chamfer, "Width of the 45 degree chamfer of its lower edge [m].");
  }
};

/// The hole, its frame T at the centre of the top face, Z out of the tube.
struct Tube {
  double inner_radius = 0.0;  ///< [m]
  double outer_radius = 0.0;  ///< [m]
  double depth = 0.0;         ///< [m]
  Pose T_base_tube = Pose::Identity();
  double chamfer = 0.0;  ///< [m]

  static constexpr std::array<std::pair<std::string_view, std::string_view>, 1> file_keys = {
      {{"T_base_tube", "T_B_T"}}};
  static constexpr std::array<std::string_view, 4> required = {"inner_radius", "outer_radius", "depth", "T_B_T"};
  static void each_field(auto& self, auto&& visit) {
    visit("inner_radius", self.inner_radius, "Radius of the bore [m].");
    visit("outer_radius", self.outer_radius, "Outer radius of the tube [m].");
    visit("depth", self.depth, "Depth of the bore [m].");
    visit("T_base_tube", self.T_base_tube,
          "Pose of the tube in the base: centre of its top face, Z out of the tube [m, rad].");
    visit("chamfer", self.chamfer, "Width of the 45 degree chamfer of the bore [m].");
  }
};

/// Contact of the tool with what it presses on.
struct Contact {
  double stiffness = 0.0;  ///< [N/m]
  double damping = 0.0;    ///< [N s/m]
  double friction = 0.0;   ///< [-]

  static constexpr std::array<std::string_view, 3> required = {"stiffness", "damping", "friction"};
  static void each_field(auto& self, auto&& visit) {
    visit("stiffness", self.stiffness, "Total stiffness of the contact and all compliance in series [N/m].");
    visit("damping", self.damping, "Damping [N s/m].");
    visit("friction", self.friction, "Friction coefficient of peg on tube [-].");
  }
};

}  // namespace kr5::cell
