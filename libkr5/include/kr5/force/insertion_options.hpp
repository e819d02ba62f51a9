// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/force/peg_on_tube.hpp>

/// @file
/// What a peg is inserted with: bodies, forces, speeds, limits. Hayat et al. 2022, sections 5.6 and 6.4.

namespace kr5::force {

/// Localisation of the hole from the turn of the tilted peg.
enum class Localisation {
  Fit,      ///< The whole profile, by the exact geometry: direction and distance.
  Cusp,     ///< The sharper of the minima: direction.
  Minimum,  ///< The least height: direction, the wrong one beyond the critical offset (5.39).
};
constexpr auto enum_names(Localisation) {
  using enum Localisation;
  return names<Localisation>({{Fit, "fit"}, {Cusp, "cusp"}, {Minimum, "minimum"}});
}

/// Way of the peg from the place of the turn into the hole.
enum class EntryAttitude {
  Tilted,   ///< Rim first, upright only when the rim is in the bore.
  Upright,  ///< Upright on the face, slid until it drops.
};
constexpr auto enum_names(EntryAttitude) {
  return names<EntryAttitude>({{EntryAttitude::Tilted, "tilted"}, {EntryAttitude::Upright, "upright"}});
}

/// Drive of the peg after it has entered the mouth of the bore.
enum class InsertBy {
  Arm,      ///< The arm, which holds it.
  Gravity,  ///< Its weight: the grip lets it slide.
  Air,      ///< Compressed air through the grip.
};
constexpr auto enum_names(InsertBy) {
  return names<InsertBy>({{InsertBy::Arm, "arm"}, {InsertBy::Gravity, "gravity"}, {InsertBy::Air, "air"}});
}

/// Believed compliance between arm and peg, by which forces give displacements.
struct GripModel {
  double axial = 23.38e3;    ///< [N/m]
  double lateral = 23.38e3;  ///< [N/m]
  double angular = 300.0;    ///< [N m/rad]
  double height = 0.04;      ///< [m]
  bool corrected = true;
  double tilt_uncertainty = 1.5e-3;    ///< [rad]
  double position_uncertainty = 1e-4;  ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit(
        "axial", self.axial,
        "Stiffness along the peg, of all compliance in series; a fit of the profile allows for an error of it [N/m].");
    visit("lateral", self.lateral, "Stiffness across the peg [N/m].");
    visit("angular", self.angular, "Stiffness against tilting [N m/rad].");
    visit("height", self.height, "Height of the grip above the peg's bottom [m].");
    visit("corrected", self.corrected,
          "Correction of the peg's pose by the compliance; otherwise the pose of the arm is used.");
    visit("tilt_uncertainty", self.tilt_uncertainty,
          "Standard deviation of the peg's tilt against the tube, as computed from arm and forces, per axis [rad].");
    visit("position_uncertainty", self.position_uncertainty,
          "Standard deviation of the peg's position, as computed from arm and forces, per axis across the peg [m].");
  }
};

struct InsertionForces {
  double touch = 3.0;           ///< [N]
  double obstacle = 6.0;        ///< [N]
  double roll = 15.0;           ///< [N]
  double slide = 8.0;           ///< [N]
  double push = 15.0;           ///< [N]
  double drop = 4.0;            ///< [N]
  double lean = 3.0;            ///< [N]
  double axial_gain = 2.5e-4;   ///< [m/(s N)]
  double lateral_gain = 2e-4;   ///< [m/(s N)]
  double angular_gain = 0.015;  ///< [rad/(s N m)]

  static void each_field(auto& self, auto&& visit) {
    visit("touch", self.touch, "Force from which contact is detected [N].");
    visit("obstacle", self.obstacle, "Force from which the approach has met something that should not be there [N].");
    visit("roll", self.roll, "Force held during the turn [N].");
    visit("slide", self.slide, "Force held while the peg slides and is set upright [N].");
    visit("push", self.push, "Force with which the peg is pushed in [N].");
    visit("drop", self.drop, "Force below which an upright peg that slides has dropped into the bore [N].");
    visit("lean", self.lean, "Lateral force on the wall of the bore while the peg is set upright [N].");
    visit("axial_gain", self.axial_gain, "Speed along the tube per error of force [m/(s N)].");
    visit("lateral_gain", self.lateral_gain, "Speed across the tube per error of force [m/(s N)].");
    visit("angular_gain", self.angular_gain, "Turning speed per moment [rad/(s N m)].");
  }
};

struct InsertionMotion {
  double height = 0.002;         ///< [m]
  double clear_height = 0.05;    ///< [m]
  double approach_speed = 0.04;  ///< [m/s]
  double contact_speed = 0.006;  ///< [m/s]
  double roll_time = 2.5;        ///< [s]
  double slide_speed = 0.008;    ///< [m/s]
  double upright_speed = 0.50;   ///< [rad/s]
  double push_speed = 0.04;      ///< [m/s]
  double acceleration = 0.3;     ///< [m/s^2]
  double braking = 0.9;          ///< [m/s^2]
  double turning = 4.0;          ///< [rad/s^2]
  double depth = 0.03;           ///< [m]
  double spiral_radius = 3e-4;   ///< [m]
  double spiral_pitch = 8e-5;    ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("height", self.height,
          "Height of the lowest point of the rim above the face at the end of the fast approach [m].");
    visit("clear_height", self.clear_height,
          "Height above the face of a known hole from which on nothing can be in the way; below it, and over a tube "
          "that no peg went into yet, the approach is no faster than the arm can be stopped [m].");
    visit("approach_speed", self.approach_speed, "Speed of the approach [m/s].");
    visit("contact_speed", self.contact_speed, "Speed of every guarded move [m/s].");
    visit("roll_time", self.roll_time, "Duration of the turn [s].");
    visit("slide_speed", self.slide_speed, "Speed of the slide towards the hole [m/s].");
    visit("upright_speed", self.upright_speed, "Turning speed at which the tilt is removed [rad/s].");
    visit("push_speed", self.push_speed, "Maximum speed while the peg is pushed in [m/s].");
    visit("acceleration", self.acceleration, "Maximum acceleration [m/s^2].");
    visit("braking", self.braking, "Maximum deceleration where a peg that is pushed in meets something [m/s^2].");
    visit("turning", self.turning, "Maximum angular acceleration [rad/s^2].");
    visit("depth", self.depth, "Depth below the face to which the peg is inserted [m].");
    visit("spiral_radius", self.spiral_radius, "Radius around a known hole in which an upright peg is tried [m].");
    visit("spiral_pitch", self.spiral_pitch, "Distance between the turns of that spiral [m].");
  }
};

/// Limits beyond which the arm stops, or an attempt ends.
struct InsertionLimits {
  double force = 80.0;       ///< [N]
  double torque = 8.0;       ///< [N m]
  Eigen::VectorXd current;   ///< [A]
  double face_error = 5e-4;  ///< [m]
  double descent = 0.004;    ///< [m]
  double travel = 0.0;       ///< [m]
  int attempts = 3;
  double time = 60.0;        ///< [s]
  double dead_after = 0.25;  ///< [s]
  double halting = 0.05;     ///< [s]

  static void each_field(auto& self, auto&& visit) {
    visit("force", self.force, "Force on the peg that stops the arm [N].");
    visit("torque", self.torque, "Torque on the peg, about its bottom, that stops the arm [N m].");
    visit("current", self.current, "Current of each motor that stops the arm; empty: not monitored [A].");
    visit("face_error", self.face_error, "Maximum error of the assumed height of the tube's face [m].");
    visit("descent", self.descent, "Distance below the face after which, without contact, no tube is assumed [m].");
    visit("travel", self.travel, "Sliding distance that ends an attempt; 0: the radius of the peg [m].");
    visit("attempts", self.attempts, "Maximum number of attempts.");
    visit("time", self.time, "Maximum total duration [s].");
    visit("dead_after", self.dead_after,
          "Time after which a sensor with unchanged readings counts as dead; 0: never [s].");
    visit("halting", self.halting,
          "Time that the arm takes to stand after a stop, by which the speed of the approach is limited [s].");
  }
};

}  // namespace kr5::force
