// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// Masses of rigid bodies.

namespace kr5::kinematics {

/// Mass of one rigid body, in a frame that the user of it names.
struct Body {
  double mass = 0.0;                              ///< [kg]
  Eigen::Vector3d com = Eigen::Vector3d::Zero();  ///< [m]
  Vector6 inertia = Vector6::Zero();              ///< Ixx Iyy Izz Ixy Ixz Iyz about the com [kg m^2].

  /// The symmetric 3x3 matrix [kg m^2].
  Eigen::Matrix3d inertia_matrix() const;

  static constexpr std::array<std::string_view, 3> required = {"mass", "com", "inertia"};
  static void each_field(auto& self, auto&& visit) {
    visit("mass", self.mass, "Mass [kg].");
    visit("com", self.com, "Centre of mass [m].");
    visit("inertia", self.inertia, "Ixx Iyy Izz Ixy Ixz Iyz about the com, axes of its frame [kg m^2].");
  }
};

/// The ten standard inertial parameters: what joint torques are linear in.
struct Moments {
  double mass = 0.0;                                 ///< [kg]
  Eigen::Vector3d first = Eigen::Vector3d::Zero();   ///< Mass times centre of mass [kg m].
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();  ///< Inertia about the origin of the frame [kg m^2].

  Moments& operator+=(const Moments& other);
};

Moments inertial_moments(const Body& body);
/// Inverse of `moments`. A body without mass has its com at the origin.
Body to_body(const Moments& moments);

/// The same body, given in frame b, described in frame a.
Body transformed_body(const Pose& T_a_b, const Body& body);
/// Two bodies of one frame, welded together.
Body merged_body(const Body& a, const Body& b);
/// What is left of a body when a part of it is taken away; nothing where that could not be a real body: without mass
/// (but for rounding), or with principal moments of which two add up to less than the third.
std::optional<Body> body_without(const Body& whole, const Body& part);
/// Whether a body could be real, in that sense.
bool is_real(const Body& body);

/// The symmetric matrix of Ixx Iyy Izz Ixy Ixz Iyz, and back.
Eigen::Matrix3d inertia_matrix(const Vector6& inertia);
Vector6 inertia_vector(const Eigen::Matrix3d& inertia);

}  // namespace kr5::kinematics
