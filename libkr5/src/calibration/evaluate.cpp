// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/evaluate.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/geometry/resection.hpp>

#include "calibration/hand_eye/model.hpp"

namespace kr5::calibration {
namespace {

using hand_eye::ObservedView;
using hand_eye::Poses;

/// T_fixed_target as the views see it through T_mount_camera.
Pose mean_target(Mount mount, const Pose& X, std::span<const HandEyeView> views, std::span<const Pose> targets) {
  std::vector<Pose> Z;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Pose& T = views[i].T_base_flange;
    Z.push_back((mount == Mount::EyeInHand ? T : Pose(T.inverse())) * X * targets[i]);
  }
  return mean_pose(Z);
}

/// Weighted squared pixel errors of a target at M; infinite when a point lies behind the camera.
double pixel_squares(const Pose& M, const ObservedView& observed, const Pinhole& camera) {
  const View& view = observed.input->view;
  double squares = 0;
  for (Eigen::Index i = 0; i < view.points.cols(); ++i) {
    const Eigen::Vector3d p = M * Eigen::Vector3d(view.points.col(i));
    if (!(p.z() > 1e-9)) return std::numeric_limits<double>::infinity();
    squares += observed.pose().weights[i] * (view.pixels.col(i) - camera.project(p)).squaredNorm();
  }
  return squares;
}

HeldOutView judge(Mount mount, const Poses& poses, const ObservedView& observed, const Pinhole& camera) {
  const Pose M = hand_eye::predict(mount, poses, observed.input->T_base_flange);
  HeldOutView out;
  out.name = observed.input->view.name;
  double best = std::numeric_limits<double>::infinity();
  for (const Resection& r : observed.found) {
    if (r.cost > 25 * std::max(observed.found.front().cost, 1e-6)) continue;  // plainly not what was seen
    const Vector6 d = pose_difference(r.T_camera_points, M);
    if (d.tail<3>().norm() >= best) continue;
    best = d.tail<3>().norm();
    out.position = d.head<3>().norm();
    out.rotation = best;
  }
  const double n = static_cast<double>(observed.input->view.points.cols());
  const double diagonal = std::hypot(camera.width, camera.height);
  out.rms_px = std::min(std::sqrt(pixel_squares(M, observed, camera) / n), diagonal);
  return out;
}

double rms(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v * v;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

void summarise(HandEyeEvaluation& out) {
  if (out.views.empty()) return;
  std::vector<double> position, rotation;
  for (const HeldOutView& v : out.views) {
    position.push_back(v.position);
    rotation.push_back(v.rotation);
  }
  out.position_rms = rms(position);
  out.rotation_rms = rms(rotation);
  out.position_median = midpoint_median(position);
  out.rotation_median = midpoint_median(rotation);
}

HandEyeEvaluation summary_of(const std::vector<std::optional<HeldOutView>>& judged) {
  HandEyeEvaluation out;
  for (const auto& view : judged) {
    if (view)
      out.views.push_back(*view);
    else
      ++out.unjudged;
  }
  summarise(out);
  return out;
}

}  // namespace

void EvaluateOptions::validate() const {
  require(folds == 0 || folds >= 2, "folds must be 0 (every view alone) or at least 2");
}

HandEyeEvaluation evaluate_hand_eye(std::span<const HandEyeView> views, const Pinhole& camera,
                                    const HandEyeSolver& solver, const EvaluateOptions& options) {
  options.validate();
  require(views.size() >= 4, "evaluate_hand_eye needs at least four views, found " + std::to_string(views.size()));
  std::vector<ObservedView> observed_views;
  for (const HandEyeView& v : views) {
    require(v.T_base_flange.matrix().allFinite(), "view " + v.view.name + ": T_base_flange must be finite");
    observed_views.push_back({.input = &v, .found = resect(v.view.points, v.view.pixels, camera), .chosen = 0});
  }
  const std::size_t folds = options.folds == 0 ? views.size() : static_cast<std::size_t>(options.folds);
  std::vector<std::optional<HeldOutView>> judged(views.size());
  for (std::size_t fold = 0; fold < folds; ++fold) {
    std::vector<HandEyeView> rest;
    std::vector<Pose> targets;
    for (std::size_t i = 0; i < views.size(); ++i)
      if (i % folds != fold && !observed_views[i].found.empty()) {
        rest.push_back(views[i]);
        targets.push_back(observed_views[i].pose().T_camera_points);
      }
    if (rest.size() < 3) continue;
    const auto found = solver(rest, targets);
    if (!found || !found->T_mount_camera.matrix().allFinite()) continue;
    const Poses poses{found->T_mount_camera,
                      found->T_fixed_target.value_or(mean_target(options.mount, found->T_mount_camera, rest, targets))};
    for (std::size_t i = fold; i < views.size(); i += folds)
      if (!observed_views[i].found.empty()) judged[i] = judge(options.mount, poses, observed_views[i], camera);
  }
  return summary_of(judged);
}

HandEyeEvaluation evaluate_hand_eye(std::span<const HandEyeView> views, const Pinhole& camera,
                                    const HandEyeOptions& calibration, int folds) {
  const HandEyeSolver ours = [&](std::span<const HandEyeView> rest,
                                 std::span<const Pose>) -> std::optional<HandEyePoses> {
    const HandEyeResult result = calibrate_hand_eye(rest, camera, calibration);
    if (!result.fit.usable()) return std::nullopt;
    return HandEyePoses{result.T_mount_camera, result.T_fixed_target};
  };
  return evaluate_hand_eye(views, camera, ours, {.mount = calibration.mount, .folds = folds});
}

HandEyeEvaluation evaluate_hand_eye_pairs(std::span<const PosePair> pairs, const HandEyePairsOptions& calibration,
                                          int folds) {
  EvaluateOptions{.mount = calibration.mount, .folds = folds}.validate();
  require(pairs.size() >= 4,
          "evaluate_hand_eye_pairs needs at least four pairs, found " + std::to_string(pairs.size()));
  const std::size_t parts = folds == 0 ? pairs.size() : std::min(static_cast<std::size_t>(folds), pairs.size());
  std::vector<std::optional<HeldOutView>> judged(pairs.size());
  for (std::size_t part = 0; part < parts; ++part) {
    std::vector<PosePair> rest;
    for (std::size_t i = 0; i < pairs.size(); ++i)
      if (i % parts != part) rest.push_back(pairs[i]);
    if (rest.size() < 3) continue;
    const HandEyeResult found = calibrate_hand_eye_pairs(rest, calibration);
    if (!found.fit.usable()) continue;
    const Poses poses{found.T_mount_camera, found.T_fixed_target};
    for (std::size_t i = part; i < pairs.size(); i += parts) {
      const Pose M = hand_eye::predict(calibration.mount, poses, pairs[i].T_base_flange);
      const Vector6 d = pose_difference(pairs[i].T_camera_target, M);
      judged[i] = HeldOutView{.name = pairs[i].name.empty() ? std::to_string(i) : pairs[i].name,
                              .position = d.head<3>().norm(),
                              .rotation = d.tail<3>().norm()};
    }
  }
  return summary_of(judged);
}

}  // namespace kr5::calibration
