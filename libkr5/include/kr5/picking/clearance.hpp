// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/picking/bin.hpp>

/// @file
/// Distance between the gripper and the walls of a bin (Hayat et al. 2022, section 6.2.3).

namespace kr5::picking {

/// A length of the gripper: a cylinder about its axis.
struct GripperPart {
  double radius = 0.006;
  double start = 0.0;
  double end = 0.15;

  static void each_field(auto& self, auto&& visit) {
    visit("radius", self.radius, "Radius [m].");
    visit("start", self.start, "Distance from the tip at which it begins [m].");
    visit("end", self.end, "Distance from the tip at which it ends [m].");
  }
};

/// A gripper whose tip stands at `tip` and whose axis points away from the surface along `outwards`.
struct GripperPose {
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();        ///< [m]
  Eigen::Vector3d outwards = Eigen::Vector3d::UnitZ();  ///< Of length 1.
};

/// Distance between a solid cylinder with flat ends and a solid box: never more than the true one, and less by at most
/// 1e-9 m or a 1e-9th of it; 0 when they touch or share a point.
/// @param T_base_cylinder Centre of the cylinder, Z its axis. @param T_base_box Centre of the box.
/// @param half Half the sides of the box [m]. @throws InvalidArgument for a size that is not positive.
double cylinder_box_distance(const Pose& T_base_cylinder, double radius, double height, const Pose& T_base_box,
                             const Eigen::Vector3d& half);

/// Least distance between the gripper and the four walls and the floor [m]; 0 when it touches. A part that moves along
/// the axis of the gripper sweeps a longer cylinder: with parts that reach above the rim this is the clearance of the
/// whole straight approach. The walls end at the rim and at the corners, and have their thickness.
/// @throws InvalidArgument for an invalid bin or part, or a direction that is not of length 1.
double gripper_clearance(const GripperPose& gripper, const std::vector<GripperPart>& parts, const Bin& bin,
                         bool with_floor = true);

/// What the formula of the book says of a rod (eqs 6.1 to 6.3): half angle and tilt of the rod against the angle to the
/// rim of the nearer wall in its quadrant.
struct BookClearance {
  double gamma = 0.0;
  double beta = 0.0;
  bool clears = false;

  static void each_field(auto& self, auto&& visit) {
    visit("gamma", self.gamma, "Half angle of the rod and its tilt [rad].");
    visit("beta", self.beta, "Angle to the rim, from the vertical [rad].");
    visit("clears", self.clears, "Whether gamma is less than beta.");
  }
};

/// The formula as printed. It is safe only where the rod leans square to a wall: the distance from the rim it allows
/// shrinks with the angle between the lean and the wall's normal (6.00, 5.67, 4.76 and 3.47 mm for a rod of 6 mm at 0,
/// 20, 40 and 60 degrees, 60 mm below the rim and 25 mm from the wall), and it knows no corners. Use gripper_clearance.
BookClearance book_clearance(const GripperPose& gripper, double radius, const Bin& bin);

}  // namespace kr5::picking
