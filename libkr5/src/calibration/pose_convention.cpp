// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/pose_convention.hpp>

#include <algorithm>
#include <optional>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>

namespace kr5::calibration {
namespace {

constexpr double lever = 0.5;  ///< At which an error of rotation counts as one of position [m].

bool are_same(const std::vector<Pose>& a, const std::vector<Pose>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const Pose& p, const Pose& q) { return p.matrix().isApprox(q.matrix(), 1e-6); });
}

/// Poses of every reading that differs from those before it.
std::vector<std::pair<PoseFormat, std::vector<Pose>>> distinct_readings(const std::vector<PoseRows>& readings) {
  std::vector<std::pair<PoseFormat, std::vector<Pose>>> out;
  for (const PoseRows& reading : readings)
    for (const PoseFormat& format : plausible_formats(reading.rows)) {
      if (format.rotation != reading.rotation || format.meaning != PoseMeaning::BaseFlange) continue;
      std::vector<Pose> poses = to_poses(reading.rows, format);
      const bool known =
          std::any_of(out.begin(), out.end(), [&](const auto& other) { return are_same(poses, other.second); });
      if (!known) out.emplace_back(format, std::move(poses));
    }
  return out;
}

/// Disagreement of robot and camera [m]; nothing when there is no calibration.
std::optional<double> disagreement(const std::vector<Pose>& poses, const std::vector<ViewOfPose>& views,
                                   const Pinhole& camera, Mount mount) {
  std::vector<HandEyeView> data;
  for (const ViewOfPose& seen : views) data.push_back({poses[static_cast<std::size_t>(seen.pose)], seen.view});
  HandEyeOptions options;
  options.mount = mount;
  const HandEyeResult result = calibrate_hand_eye(data, camera, options);
  if (!result.fit.usable()) return {};
  std::vector<double> errors;
  for (const HandEyeViewReport& view : result.views)
    errors.push_back(view.robot_position + lever * view.robot_rotation);
  return midpoint_median(errors);
}

}  // namespace

std::vector<PoseConvention> rank_conventions(const std::vector<PoseRows>& readings,
                                             const std::vector<ViewOfPose>& views, const Pinhole& camera) {
  for (const PoseRows& reading : readings)
    for (const ViewOfPose& seen : views)
      require(seen.pose >= 0 && seen.pose < reading.rows.rows(), "views: found a view of pose " +
                                                                     std::to_string(seen.pose) + ", expected one of " +
                                                                     std::to_string(reading.rows.rows()) + ", from 0");
  std::vector<PoseConvention> out;
  for (const auto& [format, poses] : distinct_readings(readings))
    for (const Mount mount : {Mount::EyeInHand, Mount::EyeToHand})
      if (const auto error = disagreement(poses, views, camera, mount)) out.push_back({format, mount, *error});
  std::stable_sort(out.begin(), out.end(),
                   [](const PoseConvention& a, const PoseConvention& b) { return a.error < b.error; });
  return out;
}

}  // namespace kr5::calibration
