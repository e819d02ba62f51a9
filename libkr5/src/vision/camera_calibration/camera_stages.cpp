// SPDX-License-Identifier: BSD-3-Clause
#include "vision/camera_calibration/camera_stages.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <kr5/geometry/resection.hpp>

#include "vision/camera_calibration/view_test.hpp"

namespace kr5::vision::detail {
namespace {

double rms_of(const CameraProblem& problem, const CameraState& state, const std::vector<bool>& used) {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    const Eigen::Matrix2Xd e = residuals(problem, state, i);
    sum += e.squaredNorm(), count += 2.0 * double(e.cols());
  }
  return count > 0 ? std::sqrt(sum / count) : 0.0;
}

bool same_focal(const CameraState& one, const CameraState& other) {
  constexpr double close = 0.01;  // relative
  return std::abs(std::log(one.camera.fx / other.camera.fx)) < close;
}

/// The same camera, each flat target in its other pose where that is near; the given state where none is.
CameraState turned_over(const CameraProblem& problem, CameraState state, const std::vector<bool>& used) {
  constexpr double near = 4.0;  // ratio of squares
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    const auto found = resect(problem.views[i].points, problem.views[i].pixels, state.camera);
    if (found.size() < 2 || found[1].cost > near * found[0].cost) continue;
    state.poses[i] = found[1].T_camera_points;
  }
  return state;
}

}  // namespace

CameraModel reference_model(const CameraOptions& options) {
  return {options.lens.value_or(LensModel::Brown5), options.square_pixels.value_or(false),
          options.bent_target.value_or(false)};
}

CameraStages::CameraStages(const CameraProblem& problem, const CameraOptions& options, CameraStart start,
                           std::vector<CameraViewReport>& reports)
    : weights(problem.views.size(), 0.0),
      problem_(problem),
      options_(options),
      start_(std::move(start)),
      reports_(reports),
      usable_(start_.sound) {
  reports_.assign(weights.size(), {});
  for (std::size_t i = 0; i < weights.size(); ++i) {
    reports_[i].name = problem.views[i].name;
    if (!usable_[i]) exclude(i, "no pose explains its points: they seem to be in the wrong order");
  }
}

bool CameraStages::any() const { return std::find(usable_.begin(), usable_.end(), true) != usable_.end(); }

void CameraStages::exclude(std::size_t view, const std::string& why) {
  usable_[view] = false;
  reports_[view].outlier = true;
  reports_[view].reason = why;
}

/// A flat target seen from behind among others seen from the front: its points are numbered mirror-wise.
void CameraStages::exclude_mirrored_views(const CameraState& state) {
  if (!problem_.plane.flat) return;
  const auto side = [&](std::size_t i) {
    const Pose& T = state.poses[i];
    return (T.linear() * problem_.plane.basis.col(2)).dot(T * problem_.plane.centre) > 0 ? 1 : -1;
  };
  int sum = 0;
  for (std::size_t i = 0; i < usable_.size(); ++i) sum += usable_[i] ? side(i) : 0;
  for (std::size_t i = 0; i < usable_.size(); ++i)
    if (usable_[i] && sum != 0 && side(i) * sum < 0)
      exclude(i, "mirrored: its points are in the opposite order to those of the other views");
}

RobustAdjustment CameraStages::rough(const CameraState& from) const {
  return adjust_robustly(problem_, {LensModel::K1, true, false, true}, from, usable_, true, 2);
}

/// Focal lengths that are near, and flat targets in their other poses where a view does not tell which is right.
std::vector<CameraState> CameraStages::starts() {
  std::vector<CameraState> out = start_.states;
  initial_rms = rms_of(problem_, out.front(), usable_);
  const CameraState first = rough(out.front()).adjustment.state();
  CameraState other = turned_over(problem_, first, usable_);
  if (!same(first, other)) out.push_back(std::move(other));
  return out;
}

fit::pipeline::Minimum<CameraState> CameraStages::descend(const CameraState& from) const {
  const CameraState there = rough(from).adjustment.state();
  return {from, rms_of(problem_, there, usable_)};
}

/// A rough fit, by which mirrored views are known.
void CameraStages::begin(const CameraState& from) {
  fit = rough(from);
  rough_iterations = fit->adjustment.iterations();
  exclude_mirrored_views(fit->adjustment.state());
  for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = usable_[i] ? 1.0 : 0.0;
  settled_ = false;
}

void CameraStages::find_noise() {
  const std::vector<bool> in(weights.begin(), weights.end());
  fit = adjust_robustly(problem_, reference_model(options_), fit->adjustment.state(), in, options_.robust,
                        settled_ ? 2 : 3);
  settled_ = true;
}

/// A view that is out stays out: what it says was compared with what the others say when it left.
std::vector<double> CameraStages::probabilities() {
  const std::vector<bool> in(weights.begin(), weights.end());
  const ViewTest test = test_views(*fit, in, options_.correlation, reports_);
  std::vector<double> out(weights.size(), 0.0);
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (!in[i]) continue;
    out[i] = test.noisy[i] ? 0.0 : reports_[i].probability;
    reports_[i].reason = test.noisy[i] ? "its points scatter far more than those of the other views"
                                       : "it requires a different camera from the other views";
  }
  return out;
}

/// All views, robust, with the noise that was found.
fit::pipeline::Minimum<CameraState> CameraStages::revisit(const CameraState& from) const {
  CameraAdjustment there(problem_, reference_model(options_), from);
  const auto noise = [&](std::size_t i) { return fit->view_noise[i] > 0 ? fit->view_noise[i] : fit->sigma; };
  Weights point_weights(weights.size());
  for (int round = 0; round < 3; ++round) {
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const Eigen::Matrix2Xd e = residuals(problem_, there.state(), i);
      point_weights[i].resize(0);
      if (usable_[i] && e.cols() > 0) point_weights[i] = huber_weights(e, noise(i)) / (noise(i) * noise(i));
    }
    there.set_weights(point_weights);
    there.minimise();
  }
  fit::pipeline::Minimum<CameraState> out{there.state(), 0.0};
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (!usable_[i]) continue;
    const Eigen::Matrix2Xd e = residuals(problem_, there.state(), i);
    if (e.cols() == 0) return {there.state()};
    out.cost += huber_cost(e, noise(i));
  }
  return out;
}

/// Whether focal lengths and poses of the targets are about the same.
bool CameraStages::same(const CameraState& one, const CameraState& other) const {
  constexpr double close_turn = 0.02;  // [rad]
  if (!same_focal(one, other)) return false;
  for (std::size_t i = 0; i < weights.size(); ++i)
    if (usable_[i] && pose_difference(one.poses[i], other.poses[i]).tail<3>().norm() > close_turn) return false;
  return true;
}

void CameraStages::name_outliers() {
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (usable_[i]) reports_[i].outlier = weights[i] == 0;
    if (!reports_[i].outlier) reports_[i].reason.clear();
  }
  if (options_.reject_views) return;
  for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = usable_[i] ? 1.0 : 0.0;
  find_noise();
}

std::optional<SecondCamera> CameraStages::second(const CameraState& best,
                                                 const fit::pipeline::Rival<CameraState>& rival,
                                                 double dispersion) const {
  if (same_focal(best, rival.at)) return std::nullopt;
  std::size_t view = 0;
  const auto turn = [&](std::size_t i) { return pose_difference(best.poses[i], rival.at.poses[i]).tail<3>().norm(); };
  for (std::size_t i = 0; i < weights.size(); ++i)
    if (usable_[i] && (!usable_[view] || turn(i) > turn(view))) view = i;
  const auto minimum = fit::pipeline::second_minimum(
      best.poses[view], rival.at.poses[view], rival.best_cost / dispersion, rival.cost / dispersion, 2.0 * fit->points);
  if (!minimum) return std::nullopt;
  return SecondCamera{rival.at.camera.fx, *minimum};
}

std::vector<bool> CameraStages::used() const { return {weights.begin(), weights.end()}; }

}  // namespace kr5::vision::detail
