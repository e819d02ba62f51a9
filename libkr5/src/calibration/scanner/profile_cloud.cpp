// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/profile_cloud.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/geometry/pose_interpolation.hpp>

namespace kr5::calibration {
namespace {

bool is_measured(const LineProfile& profile, Eigen::Index k) {
  return std::isfinite(profile.x[k]) && std::isfinite(profile.z[k]);
}

}  // namespace

void ProfileCloudOptions::validate() const {
  require(std::isfinite(delay), "delay must be finite [s]");
  require(max_gap > 0, "max_gap must be positive [s]");
}

InterpolatedPoses interpolate_poses(std::span<const double> t, std::span<const Pose> poses,
                                    std::span<const double> times, double max_gap) {
  require(!poses.empty() && t.size() == poses.size(), "found " + std::to_string(t.size()) + " times and " +
                                                          std::to_string(poses.size()) +
                                                          " poses, expected as many, and at least one");
  for (std::size_t i = 0; i < t.size(); ++i)
    require(std::isfinite(t[i]) && (i == 0 || t[i] > t[i - 1]),
            "pose " + std::to_string(i + 1) + ": times must increase from pose to pose [s]");
  InterpolatedPoses out;
  for (const double time : times) {
    const auto after = std::lower_bound(t.begin(), t.end(), time);
    Pose& pose = out.poses.emplace_back(Pose::Identity());
    out.inside.push_back(false);
    if (after == t.end()) continue;  // also NaN
    const auto k = static_cast<std::size_t>(after - t.begin());
    if (*after == time) {
      pose = poses[k];
    } else {
      if (k == 0 || t[k] - t[k - 1] > max_gap) continue;
      pose = interpolate_pose(poses[k - 1], poses[k], (time - t[k - 1]) / (t[k] - t[k - 1]));
    }
    out.inside.back() = true;
  }
  return out;
}

ProfileCloud profiles_to_cloud(std::span<const LineProfile> profiles, std::span<const Pose> T_base_flange,
                               const Pose& T_flange_scanner) {
  require(profiles.size() == T_base_flange.size(), "found " + std::to_string(profiles.size()) + " profiles and " +
                                                       std::to_string(T_base_flange.size()) +
                                                       " poses, expected as many");
  Eigen::Index count = 0;
  for (const LineProfile& profile : profiles) {
    require(profile.x.size() == profile.z.size(), "a profile has x and z of different lengths");
    for (Eigen::Index k = 0; k < profile.x.size(); ++k) count += is_measured(profile, k);
  }
  ProfileCloud out;
  out.points.resize(3, count), out.profile.resize(count), out.x.resize(count);
  Eigen::Index at = 0;
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    const Pose T = T_base_flange[i] * T_flange_scanner;
    for (Eigen::Index k = 0; k < profiles[i].x.size(); ++k) {
      if (!is_measured(profiles[i], k)) continue;
      out.points.col(at) = T * Eigen::Vector3d(profiles[i].x[k], 0.0, profiles[i].z[k]);
      out.profile[at] = static_cast<int>(i);
      out.x[at++] = profiles[i].x[k];
    }
  }
  return out;
}

ProfileCloud profiles_to_cloud(std::span<const TimedProfile> profiles, std::span<const double> t,
                               std::span<const Pose> T_base_flange, const Pose& T_flange_scanner,
                               const ProfileCloudOptions& options) {
  options.validate();
  std::vector<double> times;
  for (const TimedProfile& profile : profiles) times.push_back(profile.t - options.delay);
  const InterpolatedPoses at = interpolate_poses(t, T_base_flange, times, options.max_gap);
  std::vector<LineProfile> inside;
  std::vector<Pose> poses;
  std::vector<int> number, dropped;
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    if (!at.inside[i]) {
      dropped.push_back(static_cast<int>(i));
      continue;
    }
    inside.push_back(profiles[i].profile);
    poses.push_back(at.poses[i]);
    number.push_back(static_cast<int>(i));
  }
  ProfileCloud out = profiles_to_cloud(inside, poses, T_flange_scanner);
  for (int& profile : out.profile) profile = number[static_cast<std::size_t>(profile)];
  out.dropped = std::move(dropped);
  return out;
}

}  // namespace kr5::calibration
