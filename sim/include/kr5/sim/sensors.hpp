// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

#include <kr5/cell/cell.hpp>
#include <kr5/core/fields.hpp>
#include <kr5/core/random.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/physics/effective_drives.hpp>
#include <kr5/physics/wrench_sensor.hpp>

/// @file
/// Sensors that are read one sample after the other, with their noise and steps.

namespace kr5::sim {

struct WristSensorOptions {
  double force_resolution = 0.0625;                  ///< [N]
  double torque_resolution = 0.0;                    ///< [N m]
  Matrix6 calibration = 20.0 * Matrix6::Identity();  ///< [N/V, N m/V]
  double full_scale = 10.0;                          ///< [V]
  bool noise = true;
  std::uint64_t seed = 1;

  /// @throws InvalidArgument naming the field.
  void validate() const;
  static void each_field(auto& self, auto&& visit) {
    visit("force_resolution", self.force_resolution, "Resolution of a force; 0: unlimited [N].");
    visit("torque_resolution", self.torque_resolution, "Resolution of a torque; 0: unlimited [N m].");
    visit("calibration", self.calibration, "Wrench over the six bridge voltages, 6 x 6 [N/V, N m/V].");
    visit("full_scale", self.full_scale, "Voltage at which a bridge saturates [V].");
    visit("noise", self.noise, "Noise of the cell, added to the wrench.");
    visit("seed", self.seed, "Random seed of the noise.");
  }
};

struct WristSensorState {
  physics::WrenchFilterState filter;
  std::string random;
  bool saturated = false;

  static void each_field(auto& self, auto&& visit) {
    visit("filter", self.filter, "Filter.");
    visit("random", self.random, "Random numbers of the noise.");
    visit("saturated", self.saturated, "Whether a bridge was saturated.");
  }
};

/// The force/torque sensor of a cell: scale, crosstalk, bias, drift and lag of its effects, then noise, the bridges
/// with their saturation, and the resolution of its output.
class WristSensor {
 public:
  /// @throws InvalidArgument naming the option; for a calibration that has no inverse.
  explicit WristSensor(const cell::Cell& cell, const WristSensorOptions& options = {});

  /// Reading of a wrench in S at time t, which does not decrease [N, N m].
  Vector6 read(const Vector6& wrench, double t);
  /// The bridge voltages of the last reading [V].
  const Vector6& voltages() const { return voltages_; }
  bool saturated() const { return saturated_; }
  WristSensorState state() const { return {filter_.state(), random_.state(), saturated_}; }
  void restore(const WristSensorState& state);

 private:
  physics::WrenchSensor sensor_;
  physics::WrenchFilter filter_;
  cell::Noise noise_;
  WristSensorOptions options_;
  Matrix6 bridges_;
  Random random_;
  Vector6 voltages_ = Vector6::Zero();
  bool saturated_ = false;
};

/// Encoders on the motors: whole counts of the motor angles, after noise, taken back to the joints.
class Encoders {
 public:
  /// @param counts Counts a motor turn; 0: no steps. @param noise Of a joint value [rad or m].
  /// @throws InvalidArgument for negative values, or counts for a cell without drives.
  Encoders(const physics::EffectiveDrives& drives, double counts, double noise, std::uint64_t seed = 1);
  Eigen::VectorXd read(const Eigen::VectorXd& position);
  /// Of its random numbers.
  std::string state() const { return random_.state(); }
  void restore(const std::string& state) { random_.restore(state); }

 private:
  Eigen::MatrixXd structure_, back_;
  double count_, noise_;
  Random random_;
};

/// What drives tell of the currents of their motors: with the noise of the cell, each motor its own.
class CurrentSensors {
 public:
  /// @param noise None: currents are told as they are.
  CurrentSensors(const cell::Cell& cell, bool noise, std::uint64_t seed = 1)
      : noise_(cell.noise), noisy_(noise), random_(seed ^ own_numbers) {}
  /// @param current Of each motor; empty: the cell has none [A].
  Eigen::VectorXd read(const Eigen::VectorXd& current);
  /// Of its random numbers.
  std::string state() const { return random_.state(); }
  void restore(const std::string& state) { random_.restore(state); }

 private:
  static constexpr std::uint64_t own_numbers = 0x63757272;  // none of those that another sensor of the seed draws

  cell::Noise noise_;
  bool noisy_;
  Random random_;
};

}  // namespace kr5::sim
