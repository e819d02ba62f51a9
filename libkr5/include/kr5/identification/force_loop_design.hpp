// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include <kr5/cell/drives.hpp>
#include <kr5/core/fields.hpp>
#include <kr5/force/force_loop.hpp>
#include <kr5/robot/cycle.hpp>

/// @file
/// Design of the force loop of `force::ForceLoop` on an identified servo and contact (Hayat et al. 2022, section
/// 5.3.2): gain, compensator, steady error and stability margins of the sampled loop, over a range of stiffness.

namespace kr5::identification {

/// What the loop acts on: the servo of the path correction, whose commands are held over a cycle, and the contact.
struct ForceLoopPlant {
  cell::SecondOrder servo;
  double servo_gain = 1.0;
  double cycle = robot::usual_cycle;
  double stiffness = 23.38e3;
  double damping = 0.0;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("servo", self.servo, "Servo of the path correction; its delay may be a part of a cycle.");
    visit("servo_gain", self.servo_gain, "Position at rest over command [-].");
    visit("cycle", self.cycle, "Cycle of the loop [s].");
    visit("stiffness", self.stiffness, "Stiffness of the contact [N/m].");
    visit("damping", self.damping, "Damping of the contact [N s/m].");
  }
};

struct ForceLoopDesignOptions {
  double reference = 20.0;
  double lowest_stiffness = 0.0;
  double highest_stiffness = 0.0;
  int points = 9;
  double max_overshoot = 0.05;
  double min_gain_margin = 4.0;
  double duration = 20.0;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("reference", self.reference, "Force to be held [N].");
    visit("lowest_stiffness", self.lowest_stiffness, "Lowest stiffness to expect; 0: half that of the plant [N/m].");
    visit("highest_stiffness", self.highest_stiffness,
          "Highest stiffness to expect; 0: twice that of the plant [N/m].");
    visit("points", self.points, "Number of stiffnesses, spaced by equal factors.");
    visit("max_overshoot", self.max_overshoot,
          "Overshoot that the recommended gain keeps to at every stiffness, over the final force [-].");
    visit("min_gain_margin", self.min_gain_margin,
          "Gain margin that the recommended gain keeps at every stiffness [-].");
    visit("duration", self.duration, "Time over which the response is computed, at most 20000 cycles [s].");
  }
};

/// The loop at one stiffness.
struct ForceLoopPoint {
  double stiffness = 0.0;
  bool stable = false;
  double spectral_radius = 0.0;
  double gain_limit = 0.0;
  double gain_margin = 0.0;
  std::optional<double> phase_margin;
  double final_force = 0.0;
  double steady_error = 0.0;
  double overshoot = 0.0;
  double peak_time = 0.0;
  double settling_time = 0.0;

  static void each_field(auto& self, auto&& visit) {
    visit("stiffness", self.stiffness, "Stiffness of the contact [N/m].");
    visit("stable", self.stable, "Whether every eigenvalue of the sampled loop lies within the unit circle.");
    visit("spectral_radius", self.spectral_radius, "Maximum magnitude of an eigenvalue [-].");
    visit("gain_limit", self.gain_limit, "Gain k_p at which the loop begins to oscillate [m/N].");
    visit("gain_margin", self.gain_margin, "Gain limit over the gain [-].");
    visit("phase_margin", self.phase_margin,
          "Phase left where the open loop has a gain of 1; absent where it never has [rad].");
    visit("final_force", self.final_force, "Force at which the loop rests [N].");
    visit("steady_error", self.steady_error, "Final force less the reference, over the reference [-].");
    visit("overshoot", self.overshoot, "Maximum force beyond the final one, over the final one [-].");
    visit("peak_time", self.peak_time, "Time of the greatest force after contact [s].");
    visit("settling_time", self.settling_time, "Time after which the force stays within 2 % of the final one [s].");
  }
};

struct ForceLoopDesign {
  double compensator = 1.0;
  double uncompensated_error = 0.0;
  double contact_speed = 0.0;
  double recommended_gain = 0.0;
  ForceLoopPoint nominal;
  std::vector<ForceLoopPoint> range;

  static void each_field(auto& self, auto&& visit) {
    visit("compensator", self.compensator,
          "Factor C on the reference, eq. 5.17; 1 for corrections of the actual pose [-].");
    visit("uncompensated_error", self.uncompensated_error,
          "Steady error without the compensator over the reference, eq. 5.16 [-].");
    visit("contact_speed", self.contact_speed, "Maximum speed at which contact may be made [m/s].");
    visit("recommended_gain", self.recommended_gain,
          "Maximum gain that keeps to overshoot and gain margin at every stiffness; 0: none does [m/N].");
    visit("nominal", self.nominal, "Loop at the stiffness of the plant.");
    visit("range", self.range, "Loop over the range of stiffness.");
  }
};

/// The design of a loop: exact eigenvalues of the sampled loop, whose commands are held over each cycle and arrive
/// after the delay of the servo, and its response to a step of the reference at the moment of contact, without the
/// limits of `loop`. The compensator is that of `loop.stiffness`, so a plant of another stiffness shows its steady
/// error.
/// @throws InvalidArgument naming the offending field.
ForceLoopDesign design_force_loop(const ForceLoopPlant& plant, const force::ForceLoopOptions& loop,
                                  const ForceLoopDesignOptions& options = {});

/// Matrix of the sampled closed loop: position [m] and speed [m/s] of the servo, then the commands on their way, the
/// oldest first [m]. @param gain k_p [m/N].
Eigen::MatrixXd force_loop_matrix(const ForceLoopPlant& plant, force::CorrectionReference correction, double gain);

}  // namespace kr5::identification
