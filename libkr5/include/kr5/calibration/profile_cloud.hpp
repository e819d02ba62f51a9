// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include <kr5/calibration/profile_features.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// Profiles of a moving scanner as a cloud of points in the base (Hayat et al. 2022, eq. 2.8 and section 3.5).

namespace kr5::calibration {

/// A profile and when it was taken.
struct TimedProfile {
  double t = 0.0;  ///< [s]
  LineProfile profile;

  static void each_field(auto& self, auto&& visit) {
    visit("t", self.t, "Time at which it was taken, by the clock of the poses plus the delay [s].");
    visit("profile", self.profile, "Points of the line.");
  }
};

struct ProfileCloudOptions {
  double delay = 0.0;    ///< [s]
  double max_gap = 0.1;  ///< [s]

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("delay", self.delay, "Time by which the stamps of the profiles are late [s].");
    visit("max_gap", self.max_gap, "Longest time between two poses across which they are interpolated [s].");
  }
};

/// Points in the base, in the order of the profiles.
struct ProfileCloud {
  Eigen::Matrix3Xd points;  ///< [m]
  Eigen::VectorXi profile;
  Eigen::VectorXd x;  ///< [m]
  std::vector<int> dropped;

  static void each_field(auto& self, auto&& visit) {
    visit("points", self.points, "Points in the base, 3 x n [m].");
    visit("profile", self.profile, "Number of the profile of each point, from 0.");
    visit("x", self.x, "Place of each point along its profile [m].");
    visit("dropped", self.dropped, "Numbers of the profiles that were taken outside the poses or in a gap of them.");
  }
};

/// Pose at each of `times` between poses with time stamps: the position moves straight, the orientation by slerp.
/// Identity with `inside` false outside the stamps and across gaps.
struct InterpolatedPoses {
  std::vector<Pose> poses;
  std::vector<bool> inside;
};
/// @throws InvalidArgument for times that do not increase, numbers that differ, or no pose.
InterpolatedPoses interpolate_poses(std::span<const double> t, std::span<const Pose> poses,
                                    std::span<const double> times, double max_gap);

/// Cloud of profiles whose flange pose is known, one each.
/// @throws InvalidArgument for numbers that differ.
ProfileCloud profiles_to_cloud(std::span<const LineProfile> profiles, std::span<const Pose> T_base_flange,
                               const Pose& T_flange_scanner);

/// The same with poses at times of their own: the pose of each profile is that at its time minus the delay.
ProfileCloud profiles_to_cloud(std::span<const TimedProfile> profiles, std::span<const double> t,
                               std::span<const Pose> T_base_flange, const Pose& T_flange_scanner,
                               const ProfileCloudOptions& options = {});

}  // namespace kr5::calibration
