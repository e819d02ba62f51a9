// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include "calibration/hand_eye/model.hpp"

/// @file
/// Private: first values for a hand-eye fit, from poses of the target alone.

namespace kr5::calibration::hand_eye {

/// How far the wrist turned: the largest turn between two views, and the largest turn about an axis at right angles to
/// the main one [rad].
struct WristTurn {
  double most = 0.0;
  double second = 0.0;
};
WristTurn wrist_turn(std::span<const Pose> T_base_flange);

/// Why so little turning determines nothing, in words; empty when it is enough.
std::string turn_shortage(std::span<const Pose> T_base_flange, double min_rotation);

constexpr double farthest_pose = 1e5;  // one in millimetres is a cause to name, one beyond that no pose [m]

/// Distance at which a turn of the robot moves the tool as far as its position error: the usual reach of this arm [m].
double usual_reach(std::span<const HandEyeView> views);

/// First values, and what they believe of the views.
struct RobustStart {
  Poses poses;
  std::vector<int> chosen;  ///< By view, among the poses of its target.
  double trimmed = 0.0;     ///< Squared disagreement of the better 60 % of views [rad^2].
};

/// First values that a minority of contradicting views does not spoil: closed forms of many small subsets and of all
/// views, judged by their better 60 % of views (least trimmed squares), which choose among two poses of a planar
/// target. The best, and after it other ones where the subsets do not all end at the same.
std::vector<RobustStart> robust_starts(Mount mount, std::vector<ObservedView> observed_views, double lever);

std::vector<int> chosen_of(const std::vector<ObservedView>& observed_views);

/// Whether two pairs of poses are about the same.
bool same_poses(const Poses& one, const Poses& other, double lever);

/// T_fixed_target that a given T_mount_camera implies: the middle view's, which a minority of bad ones does not move.
Pose fixed_target(Mount mount, const Pose& T_mount_camera, std::span<const ObservedView> observed_views);

/// For each view the pose of the target that agrees best with X and Z.
void choose_poses(Mount mount, const Poses& poses, std::vector<ObservedView>& observed_views, double lever);

/// Error of the robot pose that would explain the view's chosen pose of the target.
Vector6 robot_error(Mount mount, const Poses& poses, const ObservedView& observed);

}  // namespace kr5::calibration::hand_eye
