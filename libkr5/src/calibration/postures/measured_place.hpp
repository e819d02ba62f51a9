// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include <kr5/calibration/kinematics.hpp>
#include <kr5/core/error.hpp>

/// @file
/// Private: what the checks of postures take of one.

namespace kr5::calibration {

/// Where the tool, or the first point that was seen, is [m].
inline std::optional<Eigen::Vector3d> measured_place(const ArmPosture& posture) {
  if (!posture.T_world_tool && posture.points.cols() == 0) return std::nullopt;
  const Eigen::Vector3d out =
      posture.T_world_tool ? Eigen::Vector3d(posture.T_world_tool->translation()) : posture.points.col(0);
  return out.allFinite() ? std::optional(out) : std::nullopt;
}

/// @throws InvalidArgument for joint values that do not fit the arm, or are not finite.
inline void check_joint_values(const ArmPosture& posture, std::size_t row, std::size_t joints) {
  const std::string where = "posture " + (posture.name.empty() ? std::to_string(row) : posture.name) + ": ";
  require(static_cast<std::size_t>(posture.q.size()) == joints, where + "found " + std::to_string(posture.q.size()) +
                                                                    " joint values, the arm has " +
                                                                    std::to_string(joints) + " joints");
  require(posture.q.allFinite(), where + "joint values must be finite");
}

}  // namespace kr5::calibration
