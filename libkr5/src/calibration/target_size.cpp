// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/target_size.hpp>

#include <algorithm>
#include <string>
#include <utility>

#include <kr5/calibration/hand_eye_diagnosis.hpp>
#include <kr5/core/error.hpp>

namespace kr5::calibration {
namespace {

constexpr std::size_t tried = 3;  // conventions, the best first

/// Rows of the poses of the views, read in a form of rotation.
Eigen::MatrixXd rows_of_views(const std::vector<PoseRows>& readings, const std::vector<ViewOfPose>& views,
                              RotationForm rotation) {
  const auto reading =
      std::find_if(readings.begin(), readings.end(), [&](const PoseRows& one) { return one.rotation == rotation; });
  require(reading != readings.end(),
          "conventions: found rotation " + std::string(name_of(rotation)) + ", expected that of a reading");
  Eigen::MatrixXd out(std::ssize(views), reading->rows.cols());
  for (std::size_t i = 0; i < views.size(); ++i) {
    require(views[i].pose >= 0 && views[i].pose < reading->rows.rows(),
            "views: found a view of pose " + std::to_string(views[i].pose) + ", expected one of " +
                std::to_string(reading->rows.rows()) + ", from 0");
    out.row(static_cast<Eigen::Index>(i)) = reading->rows.row(views[i].pose);
  }
  return out;
}

/// How many times as large as stated the target is under a reading of the poses.
std::optional<double> size_factor(const std::vector<PoseRows>& readings, const std::vector<ViewOfPose>& views,
                                  const Pinhole& camera, const PoseConvention& convention) {
  HandEyeRecording recording;
  recording.rows = rows_of_views(readings, views, convention.format.rotation);
  recording.format = convention.format;
  recording.camera = camera;
  recording.mount = convention.mount;
  const std::vector<Pose> poses = to_poses(recording.rows, convention.format);
  std::vector<HandEyeView> data;
  for (std::size_t i = 0; i < views.size(); ++i) {
    recording.views.push_back(views[i].view);
    data.push_back({poses[i], views[i].view});
  }
  HandEyeOptions options;
  options.mount = convention.mount;
  const HandEyeDiagnosis diagnosis = diagnose_hand_eye(recording, calibrate_hand_eye(data, camera, options));
  for (const NamedCause& cause : diagnosis.causes)
    if (cause.cause == HandEyeCause::TargetSizeWrong && cause.value > 0) return cause.value;
  return std::nullopt;
}

}  // namespace

std::optional<TargetSize> size_from_poses(const std::vector<PoseRows>& readings, const std::vector<ViewOfPose>& views,
                                          const Pinhole& camera, std::span<const PoseConvention> conventions) {
  std::optional<TargetSize> best;
  double least = conventions.empty() ? 0.0 : conventions.front().error;
  for (const PoseConvention& convention : conventions.first(std::min(tried, conventions.size()))) {
    const auto factor = size_factor(readings, views, camera, convention);
    if (!factor) continue;
    std::vector<ViewOfPose> scaled = views;
    for (ViewOfPose& seen : scaled) seen.view.points *= *factor;
    auto ranked = rank_conventions(readings, scaled, camera);
    if (ranked.empty() || !(ranked.front().error < least)) continue;
    least = ranked.front().error;
    best = TargetSize{*factor, std::move(ranked)};
  }
  return best;
}

}  // namespace kr5::calibration
