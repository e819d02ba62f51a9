// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/robot/cycle.hpp>

/// @file
/// From what a wrist sensor reads to what touches the tool: weight taken away, noise filtered. For one thread, cycle by
/// cycle; nothing here allocates or throws once it is made.

namespace kr5::force {

/// Fourth-order Butterworth low-pass of six channels (bilinear, cut-off prewarped).
class WrenchLowPass {
 public:
  /// @param cutoff Half-power frequency, below half the rate of the cycles [Hz]; @param cycle [s].
  /// @throws InvalidArgument otherwise.
  WrenchLowPass(double cutoff, double cycle);

  /// The filtered wrench of a cycle; the first call settles on what it is given. A wrench that is not finite gives NaN
  /// in its cycle, which a SafetyStop takes for a dead sensor, and leaves the filter as it was.
  Vector6 step(const Vector6& wrench) noexcept;
  /// Forgets everything.
  void reset() noexcept { settled_ = false; }
  /// By how much a change that goes on is late [s].
  double delay() const noexcept { return delay_; }

 private:
  /// Second-order section, in transposed direct form II.
  struct Section {
    double b0 = 1.0, a1 = 0.0, a2 = 0.0;  ///< b1 = 2 b0, b2 = b0.
    Vector6 s1 = Vector6::Zero(), s2 = Vector6::Zero();
  };
  std::array<Section, 2> sections_;
  double delay_ = 0.0;
  bool settled_ = false;
};

struct WrenchConditionerOptions {
  double cycle = robot::usual_cycle;
  double cutoff = 8.0;
  double mass = 0.0;
  Eigen::Vector3d com = Eigen::Vector3d::Zero();
  Eigen::Vector3d gravity = {0.0, 0.0, -9.81};

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("cycle", self.cycle, "Time between readings [s].");
    visit("cutoff", self.cutoff, "Half-power frequency of the low-pass, fourth-order Butterworth [Hz].");
    visit("mass", self.mass, "Mass below the sensor [kg].");
    visit("com", self.com, "Centre of mass of it in S [m].");
    visit("gravity", self.gravity, "Gravity in B [m/s^2].");
  }
};

/// Wrench of the environment on the tool, from readings of a sensor that also measures the weight of the tool.
class WrenchConditioner {
 public:
  explicit WrenchConditioner(const WrenchConditionerOptions& options);

  /// @param reading Force first, in S [N, N m]; @param R_base_sensor orientation of the sensor.
  /// @return Without the tool's weight and without what tare() took as zero, filtered, in S [N, N m].
  Vector6 step(const Vector6& reading, const Eigen::Matrix3d& R_base_sensor) noexcept;
  /// What the last finite reading held beside the weight is zero from now on: the sensor's offset, when nothing
  /// touches.
  void tare() noexcept;
  void reset() noexcept { filter_.reset(); }
  double delay() const noexcept { return filter_.delay(); }

  /// What the sensor reads of the tool's weight alone, in S [N, N m].
  Vector6 weight(const Eigen::Matrix3d& R_base_sensor) const noexcept;

 private:
  WrenchConditionerOptions options_;
  WrenchLowPass filter_;
  Vector6 zero_ = Vector6::Zero(), last_ = Vector6::Zero();
};

}  // namespace kr5::force
