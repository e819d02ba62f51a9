// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/core/fields.hpp>
#include <kr5/physics/row_range.hpp>

/// @file
/// What a force/torque sensor makes of a wrench in S: scale and crosstalk, bias and drift, then the lag of its filter.

namespace kr5::physics {

struct WrenchFilterState {
  double last = 0.0;  ///< [s]
  bool started = false;
  Vector6 shown = Vector6::Zero();  ///< [N, N m]

  static void each_field(auto& self, auto&& visit) {
    visit("last", self.last, "Time of the last reading [s].");
    visit("started", self.started, "Whether there was one.");
    visit("shown", self.shown, "What it showed [N, N m].");
  }
};

/// The filter of a sensor, reading by reading; the first one passes as it is.
class WrenchFilter {
 public:
  /// @param time_constant [s]; 0: everything passes.
  explicit WrenchFilter(double time_constant) : time_constant_(time_constant) {}

  /// What is shown of a wrench at time t, which does not decrease [N, N m].
  Vector6 pass(const Vector6& wrench, double t);
  const WrenchFilterState& state() const { return state_; }
  void restore(const WrenchFilterState& state) { state_ = state; }

 private:
  double time_constant_;
  WrenchFilterState state_;
};

/// The sensor of a cell with the effects it carries.
struct WrenchSensor {
  Matrix6 gain = Matrix6::Identity();  ///< ft_gain on its diagonal, ft_crosstalk beside it.
  Vector6 bias = Vector6::Zero();      ///< [N, N m]
  Vector6 rate = Vector6::Zero();      ///< Of the bias [N/s, N m/s].
  double time_constant = 0.0;          ///< Of the filter [s].

  WrenchSensor() = default;
  /// @throws InvalidArgument for a crosstalk from a component that does not exist.
  explicit WrenchSensor(const cell::Cell& cell);

  /// The wrench at time t before the filter: scaled, mixed, with bias and drift.
  Vector6 distorted(const Vector6& wrench, double t) const { return gain * wrench + bias + t * rate; }
};

/// Scale of each component [-].
Vector6 ft_gain(const cell::Cell& cell);
/// Share of the components (columns) that leak into others (rows) [-, m or 1/m].
/// @throws InvalidArgument as WrenchSensor.
Matrix6 ft_crosstalk(const cell::Cell& cell);
/// Offset of each component [N, N m].
Vector6 ft_bias(const cell::Cell& cell);
/// Rate at which each offset grows [N/s, N m/s].
Vector6 ft_drift(const cell::Cell& cell);
/// Share of the change of a wrench that passes a filter of this time constant within dt [s]; 1 without one.
double ft_lag(double time_constant, double dt);

/// What the sensor shows of wrenches (N x 6, changed in place) at times t; the filter starts anew with each run.
void apply_sensor_effects(const WrenchSensor& sensor, const Eigen::VectorXd& t, const std::vector<RowRange>& runs,
                          Eigen::Ref<Eigen::MatrixXd> wrench);

}  // namespace kr5::physics
