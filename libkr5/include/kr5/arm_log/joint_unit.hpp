// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/core/fields.hpp>

namespace kr5::arm_log {

/// Unit of logged joint angles of which nothing tells it.
enum class JointUnit {
  Radian,
  Degree,
  Tick,           ///< Of an encoder with 4096 a turn, 2048 in the middle.
  Percent,        ///< Of the range of the joint, 0 to 100.
  SignedPercent,  ///< Of half the range from its middle, -100 to 100.
};
constexpr auto enum_names(JointUnit) {
  using enum JointUnit;
  return names<JointUnit>(
      {{Radian, "rad"}, {Degree, "deg"}, {Tick, "tick"}, {Percent, "percent"}, {SignedPercent, "signed_percent"}});
}

struct JointUnitGuess {
  JointUnit unit = JointUnit::Radian;
  bool degrees_or_percent = false;  ///< Numbers up to 100 that lie within the limits of the joints either way.

  static void each_field(auto& self, auto&& visit) {
    visit("unit", self.unit, "Unit that the numbers tell: rad | deg | tick | percent | signed_percent.");
    visit("degrees_or_percent", self.degrees_or_percent,
          "Whether they may as well be degrees as per cent of the range of each joint.");
  }
};

/// Numbers beyond which angles are no radians.
inline constexpr double max_radians = 7.0;

/// The unit of logged joint angles by their numbers: counts of an encoder are whole and beyond degrees; per cent of a
/// range stay within 100, and rest at it or would leave the limits as degrees.
/// @param values Rows x joints that turn, in the unit; NaN where there is none. @param lower, upper Limits of these
/// joints [rad]; may be empty or infinite.
JointUnitGuess guess_joint_unit(const Eigen::MatrixXd& values, const Eigen::VectorXd& lower,
                                const Eigen::VectorXd& upper);

/// Whether loads are sizes without a sign: none of several joints ever shows one below zero, although each changes.
/// @param loads Rows x joints; NaN where there is none.
bool magnitudes_only(const Eigen::MatrixXd& loads);

}  // namespace kr5::arm_log
