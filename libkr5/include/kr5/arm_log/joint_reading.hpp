// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include <kr5/cell/recording.hpp>
#include <kr5/core/fields.hpp>

/// @file
/// Whether loads that do not fit a simulation would fit it with the joints in another order, or counted another way.

namespace kr5::arm_log {

/// How the columns of a log are those of the joints of a model.
struct JointReading {
  std::vector<int> order;    ///< Joint (from 0) of each column.
  std::vector<int> sign;     ///< Of each joint: -1 where it is counted the other way.
  std::vector<double> zero;  ///< Of each joint: added after its sign [rad or m].

  bool operator==(const JointReading&) const = default;
  static void each_field(auto& self, auto&& visit) {
    visit("order", self.order, "Joint of each column, from 0.");
    visit("sign", self.sign, "Of each joint: -1 where it is counted the other way.");
    visit("zero", self.zero, "Of each joint: added after its sign [rad or m].");
  }
};

/// The order of the joints in which the loads of a motion on measured positions fit; nothing where no order of those
/// that people meet does (two joints exchanged, all backwards, alphabetical), or that of the columns fits as well.
std::optional<std::vector<int>> fitting_order(const cell::Cell& cell, const cell::Experiment& experiment);

/// Directions and zeros, right angles apart, with which the loads of a motion on measured positions fit; nothing where
/// none makes them fit far better. One that hardly shows in the loads is not looked for.
std::optional<JointReading> fitting_convention(const cell::Cell& cell, const cell::Experiment& experiment);

/// Mean correlation of the loads of the joints with their simulation in a motion on measured positions; 1 of any other.
double load_likeness(const cell::Cell& cell, const cell::Experiment& experiment);

/// Distance of the centre of the links and the tool that each joint carries from its axis, in a posture [m].
Eigen::VectorXd lever_arms(const cell::Cell& cell, const Eigen::VectorXd& q);

/// By which the mean correlation of the joints must be above that of the columns as they are, to be believed.
inline constexpr double better_likeness = 0.15;

}  // namespace kr5::arm_log
