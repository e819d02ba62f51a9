// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <kr5/core/fields.hpp>

namespace kr5::cell {

/// Standard deviation of one reading of each sensor of the cell.
struct Noise {
  double position = 0.0;              ///< [rad or m]
  double current = 0.0;               ///< [A]
  double force = 0.0;                 ///< [N]
  double torque = 0.0;                ///< [N m]
  double pose_position = 0.0;         ///< [m]
  double pose_rotation = 0.0;         ///< [rad]
  double pixel = 0.0;                 ///< [px]
  double laser = 0.0;                 ///< [m]
  double depth = 0.0;                 ///< [m]
  std::vector<double> joint_current;  ///< One a joint, in place of `current`; empty: the same for all [A].
  std::vector<double> joint_torque;   ///< One a joint, in place of `torque` [N m or N].

  /// That of a column by its key: of a joint, from 0, where it has one of its own (`current`, `torque`; joint -1:
  /// none).
  double of(std::string_view key, int joint = -1) const;
  /// The field that tells it: `joint_torque` in place of `torque` where joints have their own.
  std::string field_of(std::string_view key, int joint = -1) const;

  static void each_field(auto& self, auto&& visit) {
    visit("position", self.position, "Joint reading [rad or m], and z of step and press experiments [m].");
    visit("current", self.current, "Motor current [A].");
    visit("force", self.force, "Force component [N].");
    visit("torque", self.torque, "Torque component, and joint torque [N m or N].");
    visit("pose_position", self.pose_position, "Position of the measured tool, per axis [m].");
    visit("pose_rotation", self.pose_rotation, "Orientation of the measured tool, per axis [rad].");
    visit("pixel", self.pixel, "Image coordinate [px].");
    visit("laser", self.laser, "Range of the line scanner [m].");
    visit("depth", self.depth, "Depth z of a profile [m].");
    visit("joint_current", self.joint_current,
          "Motor current of each joint, where they differ, in place of current [A].");
    visit("joint_torque", self.joint_torque,
          "Joint torque of each joint, where they differ, in place of torque [N m or N].");
  }
};

}  // namespace kr5::cell
