// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <numbers>
#include <span>

#include <kr5/kinematics/dh_chain.hpp>

/// @file
/// Whether joint values and robot poses are those of the same stops.

namespace kr5::calibration {

struct TurnAgreement {
  int turns = 0;
  double difference = 0.0;  ///< [rad]
  bool agrees = true;

  static void each_field(auto& self, auto&& visit) {
    visit("turns", self.turns, "Number of turns, each from one stop to the next.");
    visit("difference", self.difference,
          "Median difference of the angles by which the arm turns, by the joint values and by the poses [rad].");
    visit("agrees", self.agrees, "Whether the difference is below the limit.");
  }
};

/// Compares the angles by which the flange turns from each stop to the next, which do not depend on the frames of base
/// and tool: by the joint values (a row a stop) and by the robot's poses.
/// @param limit Of the median difference [rad].
/// @throws InvalidArgument for other numbers of rows and poses, joint values that do not fit the arm, or NaN.
TurnAgreement compare_turns(const kinematics::DhChain& arm, const kinematics::Rows& q, std::span<const Pose> poses,
                            double limit = std::numbers::pi / 90);

}  // namespace kr5::calibration
