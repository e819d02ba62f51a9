// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/force/peg_on_tube.hpp>

/// @file
/// What a peg is inserted with: bodies, forces, speeds, limits. Hayat et al. 2022, sections 5.6 and 6.4.

namespace kr5::force {

/// What tells where the hole is, once the tilted peg has gone round.
enum class Localisation {
  Fit,      ///< The whole profile, by the exact geometry: direction and distance.
  Cusp,     ///< The sharper of the minima: direction.
  Minimum,  ///< The least height: direction, the wrong one beyond the critical offset (5.39).
};
constexpr auto enum_names(Localisation) {
  using enum Localisation;
  return names<Localisation>({{Fit, "fit"}, {Cusp, "cusp"}, {Minimum, "minimum"}});
}

/// How the peg goes from where it felt round into the hole.
enum class Entry {
  Tilted,   ///< Rim first, upright only when the rim is in the bore.
  Upright,  ///< Upright on the face, slid until it drops.
};
constexpr auto enum_names(Entry) { return names<Entry>({{Entry::Tilted, "tilted"}, {Entry::Upright, "upright"}}); }

/// What pushes the peg in once it stands in the mouth of the bore.
enum class InsertBy {
  Arm,      ///< The arm, which holds it.
  Gravity,  ///< Its weight: the grip lets it slide.
  Air,      ///< Compressed air through the grip.
};
constexpr auto enum_names(InsertBy) {
  return names<InsertBy>({{InsertBy::Arm, "arm"}, {InsertBy::Gravity, "gravity"}, {InsertBy::Air, "air"}});
}

/// The believed grip between arm and peg: from which displacements are told by forces.
struct GripModel {
  double axial = 23.38e3;    ///< [N/m]
  double lateral = 23.38e3;  ///< [N/m]
  double angular = 300.0;    ///< [N m/rad]
  double height = 0.04;      ///< [m]
  bool corrected = true;
  double tilt_doubt = 1.5e-3;  ///< [rad]
  double place_doubt = 1e-4;   ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("axial", self.axial,
          "Stiffness along the peg of all that gives way; a fit of the profile allows for an error of it [N/m].");
    visit("lateral", self.lateral, "Stiffness across it [N/m].");
    visit("angular", self.angular, "Stiffness against tilting [N m/rad].");
    visit("height", self.height, "Of the grip above the peg's bottom [m].");
    visit("corrected", self.corrected, "What gives way is counted in where the peg is; otherwise the arm is believed.");
    visit("tilt_doubt", self.tilt_doubt,
          "Standard deviation of the peg's tilt against the tube from what arm and forces tell, per axis [rad].");
    visit("place_doubt", self.place_doubt,
          "Standard deviation of its place from what arm and forces tell, per axis across it [m].");
  }
};

struct InsertionForces {
  double touch = 3.0;           ///< [N]
  double roll = 15.0;           ///< [N]
  double slide = 8.0;           ///< [N]
  double push = 15.0;           ///< [N]
  double drop = 4.0;            ///< [N]
  double lean = 3.0;            ///< [N]
  double axial_gain = 2.5e-4;   ///< [m/(s N)]
  double lateral_gain = 2e-4;   ///< [m/(s N)]
  double angular_gain = 0.015;  ///< [rad/(s N m)]

  static void each_field(auto& self, auto&& visit) {
    visit("touch", self.touch, "From which the peg is taken to touch [N].");
    visit("roll", self.roll, "Held while the peg goes round [N].");
    visit("slide", self.slide, "Held while it slides and is set upright [N].");
    visit("push", self.push, "With which it is pushed in [N].");
    visit("drop", self.drop, "Below which an upright peg that slides has dropped [N].");
    visit("lean", self.lean, "With which a peg in the mouth of the bore leans on its wall while set upright [N].");
    visit("axial_gain", self.axial_gain, "Speed along the tube for an error of force [m/(s N)].");
    visit("lateral_gain", self.lateral_gain, "Speed across it for an error of force [m/(s N)].");
    visit("angular_gain", self.angular_gain, "Turning speed for a moment [rad/(s N m)].");
  }
};

struct InsertionMotion {
  double height = 0.002;         ///< [m]
  double approach_speed = 0.04;  ///< [m/s]
  double contact_speed = 0.006;  ///< [m/s]
  double roll_time = 2.5;        ///< [s]
  double slide_speed = 0.008;    ///< [m/s]
  double upright_speed = 0.50;   ///< [rad/s]
  double push_speed = 0.04;      ///< [m/s]
  double acceleration = 0.3;     ///< [m/s^2]
  double turning = 4.0;          ///< [rad/s^2]
  double depth = 0.03;           ///< [m]
  double spiral_radius = 3e-4;   ///< [m]
  double spiral_pitch = 8e-5;    ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("height", self.height, "Of the lowest point of the rim above the face, to which one comes fast [m].");
    visit("approach_speed", self.approach_speed, "Down to there [m/s].");
    visit("contact_speed", self.contact_speed, "From there on, and of every guarded move [m/s].");
    visit("roll_time", self.roll_time, "For once round [s].");
    visit("slide_speed", self.slide_speed, "Of the slide towards the hole [m/s].");
    visit("upright_speed", self.upright_speed, "With which the tilt is taken away [rad/s].");
    visit("push_speed", self.push_speed, "Most while it is pushed in [m/s].");
    visit("acceleration", self.acceleration, "Most of any motion [m/s^2].");
    visit("turning", self.turning, "Most of any turn [rad/s^2].");
    visit("depth", self.depth, "To which the peg is inserted below the face [m].");
    visit("spiral_radius", self.spiral_radius, "About a remembered hole in which an upright peg is tried [m].");
    visit("spiral_pitch", self.spiral_pitch, "Between the turns of that spiral [m].");
  }
};

/// Beyond any of these the arm stops, or an attempt ends.
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

  static void each_field(auto& self, auto&& visit) {
    visit("force", self.force, "On the peg: beyond it the arm stops [N].");
    visit("torque", self.torque, "On the peg, about its bottom: beyond it the arm stops [N m].");
    visit("current", self.current, "Of each motor: beyond it the arm stops; empty: not watched [A].");
    visit("face_error", self.face_error, "By which the believed height of the tube's face may be wrong [m].");
    visit("descent", self.descent, "Below the face without a touch: nothing is there [m].");
    visit("travel", self.travel, "Slide after which an attempt ends; 0: the radius of the peg [m].");
    visit("attempts", self.attempts, "Before it is given up.");
    visit("time", self.time, "For everything [s].");
    visit("dead_after", self.dead_after, "For which a living sensor never tells the same to the last bit; 0: any [s].");
  }
};

}  // namespace kr5::force
