// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/hand_eye_diagnosis/camera_hypotheses.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <kr5/fit/measurements/pixels.hpp>
#include <kr5/fit/measurements/pose.hpp>
#include <kr5/fit/problem.hpp>

#include "calibration/hand_eye/fit.hpp"
#include "calibration/hand_eye_diagnosis/left_out.hpp"

/// @file
/// The camera hypothesis: some intrinsic parameters are free, fitted over all pixels together with the poses.

namespace kr5::calibration::evidence {
namespace {

/// How many of fx fy cx cy k1 k2 p1 p2 k3 each hypothesis frees; 1: fx and fy at their ratio.
constexpr int kinds[] = {1, 4, 6, 9};
constexpr int max_iterations = 20;

/// The camera that all pixels ask for, with the poses of the target in every view free; nothing when there is none.
std::optional<Pinhole> fit_camera(const Case& c, int freed, const SetupHypothesis& from) {
  fit::Problem fit;
  const fit::FitBlock camera = fit.add_camera("camera", c.recording.camera), X = fit.add_pose("X", from.fit.X),
                      Z = fit.add_pose("Z", from.fit.Y);
  for (int k = std::max(freed, 2); k < Pinhole::parameter_count; ++k) fit.hold(camera, k);
  if (freed == 1) fit.tie(camera, 0, 1, c.recording.camera.fy / c.recording.camera.fx);
  for (std::size_t i = 0; i < c.sightings.views.size(); ++i) {
    const View& view = c.recording.views[static_cast<std::size_t>(c.sightings.index[i])];
    const fit::FitBlock seen =
        fit.add_nuisance_pose("T_camera_target", c.sightings.views[i].solutions.front().T_camera_target);
    const fit::FitMeasurement pixels = fit.add(
        fit::PixelMeasurement(fit::PoseChain().then(seen), camera, view.points, view.pixels, c.sightings.sigma_pixel));
    if (!fit.residuals(pixels).allFinite()) {  // beyond the range of a lens that may well be wrong
      fit.set_weight(pixels, 0.0);
      continue;
    }
    fit.add(fit::PoseMeasurement(hand_eye::robot_error_chain(c.recording.mount, c.sound.reading.robot[i], X, Z, seen),
                                 Pose::Identity(), from.fit.sigma_position, from.fit.sigma_rotation));
  }
  if (!fit.solve({.max_iterations = max_iterations, .cost_tolerance = 1e-9, .uncertainty = false}).fit.usable())
    return std::nullopt;
  const Pinhole found = fit.camera(camera);
  return found.fx > 0 && found.fy > 0 ? std::optional(found) : std::nullopt;
}

/// The hypothesis with so many parameters freed, or nothing when it cannot be fitted.
std::optional<SetupHypothesis> with_freed(const Case& c, int freed) {
  SetupHypothesis h = c.sound;
  // Twice: with the right camera the robot turns out less noisy, and then says more about the camera.
  for (int round = 0; round < 2; ++round) {
    const auto found = fit_camera(c, freed, h);
    if (!found) break;
    const Sightings again = find_sightings(c.recording.views, *found);
    if (again.index != c.sightings.index) break;
    const ReadingFit refit = fit_reading(h.reading, again);
    if (!refit.usable) break;
    h.fit = refit;
    h.camera = *found;
    h.score = refit.score + again.score() - c.sightings.score();
    h.freedom = freed;
    h.value = h.camera.fx / c.recording.camera.fx;
    h.causes = {HandEyeCause::CameraModelWrong};
  }
  if (h.causes.empty()) return std::nullopt;
  return h;
}

/// The recording without every `folds`-th view, from `fold` on.
HandEyeRecording without(const HandEyeRecording& all, int folds, int fold) {
  HandEyeRecording out = all;
  out.views.clear(), out.times.clear();
  for (std::size_t i = 0; i < all.views.size(); ++i) {
    if (static_cast<int>(i) % folds == fold) continue;
    out.rows.row(static_cast<Eigen::Index>(out.views.size())) = all.rows.row(static_cast<Eigen::Index>(i));
    out.views.push_back(all.views[i]);
  }
  out.rows.conservativeResize(static_cast<Eigen::Index>(out.views.size()), Eigen::NoChange);
  return out;
}

}  // namespace

std::vector<SetupHypothesis> other_camera(const Case& c) {
  std::vector<SetupHypothesis> out;
  for (const int freed : kinds)
    if (auto h = with_freed(c, freed)) out.push_back(std::move(*h));
  return out;
}

double held_out_with_camera(const Case& c, int freedom, int folds) {
  folds = std::min(folds, static_cast<int>(c.recording.views.size()));
  double sum = 0;
  int count = 0;
  for (int fold = 0; fold < folds; ++fold) {
    const HandEyeRecording kept = without(c.recording, folds, fold);
    Case part{kept, find_sightings(kept.views, kept.camera), to_poses(kept.rows, kept.format), {}};
    part.sound.reading = as_recorded(part, part.poses);
    part.sound.fit = fit_reading(part.sound.reading, part.sightings);
    part.sound.score = part.sound.fit.score;
    if (!part.sound.fit.usable) continue;
    const auto h = with_freed(part, freedom);
    if (!h) return std::numeric_limits<double>::infinity();  // what so few views less undo is no finding
    const Sightings seen = find_sightings(c.recording.views, h->camera);
    for (std::size_t k = 0; k < seen.index.size(); ++k) {
      if (seen.index[k] % folds != fold) continue;
      sum += squared_point_error(c.poses[static_cast<std::size_t>(seen.index[k])], seen.views[k], h->fit,
                                 c.recording.mount);
      ++count;
    }
  }
  return count ? std::sqrt(sum / count) : std::numeric_limits<double>::infinity();
}

}  // namespace kr5::calibration::evidence
