// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/hand_eye.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <Eigen/Dense>
#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/fit/pipeline/pipeline.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "calibration/hand_eye/fit.hpp"
#include "calibration/hand_eye/second_pose.hpp"
#include "calibration/hand_eye/start.hpp"

namespace kr5::calibration {
namespace {

using namespace hand_eye;

constexpr double sound_part = 0.6;  // at least this part of the views stays in the fit

std::string name_of_view(std::span<const HandEyeView> views, std::size_t i) {
  return views[i].view.name.empty() ? std::to_string(i) : views[i].view.name;
}

/// A view that is given twice would count twice, as if it had been measured twice.
void require_distinct(std::span<const HandEyeView> views) {
  std::map<std::vector<double>, std::size_t> known;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Eigen::Matrix4d& T = views[i].T_base_flange.matrix();
    const Eigen::Matrix2Xd& pixels = views[i].view.pixels;
    std::vector<double> key(T.data(), T.data() + T.size());
    key.insert(key.end(), pixels.data(), pixels.data() + pixels.size());
    const auto [first, fresh] = known.emplace(std::move(key), i);
    require(fresh, "view " + name_of_view(views, i) + " is the same as view " + name_of_view(views, first->second) +
                       ", in its robot pose and in every pixel: list each view only once");
  }
}

void check(std::span<const HandEyeView> views, const Pinhole& camera, const HandEyeOptions& options) {
  options.validate();
  camera.validate();
  require(views.size() >= 3, "hand-eye calibration needs at least three views, found " + std::to_string(views.size()));
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::string where = "view " + name_of_view(views, i) + ": ";
    const View& v = views[i].view;
    require(v.points.cols() == v.pixels.cols(),
            where + std::to_string(v.points.cols()) + " points, but " + std::to_string(v.pixels.cols()) + " pixels");
    require(v.points.cols() >= 4, where + "at least four points are needed, found " + std::to_string(v.points.cols()));
    require(v.points.allFinite() && v.pixels.allFinite(), where + "points and pixels must be finite");
    require(std::isfinite(views[i].correlation) && views[i].correlation >= 1,
            where + "correlation must be at least 1 [-]");
    require(views[i].T_base_flange.matrix().allFinite(), where + "T_base_flange must be finite");
    require(is_rotation(views[i].T_base_flange.linear(), 1e-3), where + "T_base_flange has no proper rotation");
    require(views[i].T_base_flange.translation().cwiseAbs().maxCoeff() <= farthest_pose,
            where + "T_base_flange lies more than 100 km away; is its unit right?");
  }
  require_distinct(views);
}

void first_variances(HandEyeFit& fit, const HandEyeOptions& options) {
  std::vector<double> pixel, position, rotation;
  for (std::size_t i = 0; i < fit.views().size(); ++i) {
    const Resection& r = fit.views()[i].pose();
    const Vector6 error = fit.error(i);
    pixel.push_back(r.cost / std::max(2 * r.weights.sum() - 6, 1.0));
    position.push_back(error.head<3>().squaredNorm() / 3);
    rotation.push_back(error.tail<3>().squaredNorm() / 3);
  }
  const double given[] = {options.sigma_robot_position, options.sigma_robot_rotation, options.sigma_pixel};
  fit.variances.value << median(position), median(rotation), median(pixel);
  for (int k = 0; k < 3; ++k) {
    fit.variances.free[k] = given[k] == 0;
    if (given[k] > 0) fit.variances.value[k] = given[k] * given[k];
  }
}

/// With a doubtful plane, believes the pose that pixels and robot together find more probable.
void choose_by_probability(HandEyeFit& fit) {
  for (std::size_t i = 0; i < fit.views().size(); ++i) {
    const ObservedView& observed = fit.views()[i];
    if (observed.found.size() < 2) continue;
    double best = std::numeric_limits<double>::infinity();
    int choice = observed.chosen;
    for (int k = 0; k < 2; ++k) {
      fit.choose(i, k);
      const auto view = fit.linear(i);
      if (!view) continue;
      const Vector6 e = fit.error(i);
      const double pixel = fit.variances.value[2] * observed.input->correlation;
      const double unlikely = observed.pose().cost / pixel + e.dot(fit.variances.of(*view).ldlt().solve(e));
      if (unlikely < best) best = unlikely, choice = k;
    }
    fit.choose(i, choice);
  }
}

/// Probability that a sound view lies at least so far from what the others say.
double p_value(const HandEyeFit& fit, std::size_t i, double inside) {
  const double squared = fit.deleted_distance(i);
  if (!fit.variances.free[0] && !fit.variances.free[1]) return 1 - uncertainty::chi_square_cdf(squared, 6);
  // Position and rotation noise are each estimated from half of the readings.
  const double dof = std::max(3 * inside - 6, 1.0);
  if (fit.weights[i] == 0) return 1 - uncertainty::fisher_cdf(squared / 6, 6, dof);
  const double rest = std::max(6 * inside - 18, 1.0);
  const double external = squared * rest / std::max(rest + 6 - squared, 1e-9);
  return 1 - uncertainty::fisher_cdf(external / 6, 6, std::max(dof - 3, 1.0));
}

/// Takes out of the fit what the first, robust fit found far off; the tests that follow decide.
void keep_the_nearest(HandEyeFit& fit) {
  const std::size_t n = fit.views().size();
  std::vector<std::pair<double, std::size_t>> distance;
  for (std::size_t i = 0; i < n; ++i) {
    const auto view = fit.linear(i);
    const double squared = view ? view->y.dot(fit.variances.of(*view).ldlt().solve(view->y)) : 1e300;
    distance.emplace_back(squared, i);
  }
  std::sort(distance.begin(), distance.end());
  const double scale = std::max(distance[n / 2].first / uncertainty::chi_square_quantile(0.5, 6), 1.0);
  const auto least = std::max<std::size_t>(3, static_cast<std::size_t>(std::ceil(sound_part * static_cast<double>(n))));
  for (std::size_t k = 0; k < n; ++k) {
    const auto [squared, i] = distance[k];
    fit.weights[i] = k < least || squared < scale * uncertainty::chi_square_quantile(0.995, 6) ? 1.0 : 0.0;
    if (fit.weights[i] == 0) fit.restart(i);
  }
}

/// RMS of the views' disagreements, each over its own uncertainty.
double whitened_rms(const HandEyeFit& fit) {
  double squares = 0, inside = 0;
  for (const auto& [view, weight] : fit.active()) {
    squares += view.y.dot(fit.variances.of(view).ldlt().solve(view.y));
    inside += 1;
  }
  return std::sqrt(squares / std::max(6 * inside - 12, 1.0));
}

HandEyeViewReport report(const HandEyeFit& fit, const HandEyeView& input, std::optional<std::size_t> k) {
  HandEyeViewReport out;
  const Pose M = predict(fit.mount(), fit.poses(), input.T_base_flange);
  const double diagonal = std::hypot(fit.camera().width, fit.camera().height);
  double squares = 0;
  for (int c = 0; c < input.view.points.cols(); ++c) {
    const Eigen::Vector3d p = M * input.view.points.col(c);
    // A point behind the camera, or thrown to nowhere by the lens model, counts as a whole image away.
    const double square = p.z() > 1e-9 ? (fit.camera().project(p) - input.view.pixels.col(c)).squaredNorm() : 1e300;
    squares += std::min(square, diagonal * diagonal);
  }
  out.rms_px = std::sqrt(squares / static_cast<double>(input.view.points.cols()));
  out.weight = 0;
  if (!k) return out;
  out.robot_position = fit.error(*k).head<3>().norm();
  out.robot_rotation = fit.error(*k).tail<3>().norm();
  out.weight = fit.weights[*k];
  out.outlier = out.weight == 0;
  return out;
}

/// Why the views cannot tell the answer; empty when they can.
std::string why_degenerate(const HandEyeFit& fit, const HandEyeOptions& options) {
  std::vector<Pose> T;
  for (std::size_t i = 0; i < fit.views().size(); ++i)
    if (fit.weights[i] > 0) T.push_back(fit.views()[i].input->T_base_flange);
  std::string shortage = turn_shortage(T, options.min_rotation);
  if (shortage.empty() && !fit.estimate.regular)
    shortage = "the views do not determine all twelve parameters of the two poses";
  return shortage;
}

std::string summary(const HandEyeFit& fit, std::span<const HandEyeView> views, std::span<const std::size_t> index) {
  std::string text = std::to_string(views.size()) + " views";
  std::string outliers;
  for (std::size_t k = 0; k < index.size(); ++k)
    if (fit.weights[k] == 0) outliers += (outliers.empty() ? "" : ", ") + name_of_view(views, index[k]);
  if (!outliers.empty()) text += "; contradict the others: " + outliers;
  if (index.size() < views.size())
    text += "; without a pose of the target: " + std::to_string(views.size() - index.size());
  return text;
}

void write_result(const HandEyeFit& fit, HandEyeResult& out) {
  out.T_mount_camera = fit.poses().X;
  out.T_fixed_target = fit.poses().Z;
  out.sigma_robot_position = std::sqrt(fit.variances.value[0]);
  out.sigma_robot_rotation = std::sqrt(fit.variances.value[1]);
  out.sigma_pixel = std::sqrt(fit.variances.value[2]);
  const std::vector<WeightedView> active = fit.active();
  const WidenedCovariance X = widened_covariance(active, fit.variances, 0);
  const WidenedCovariance Z = widened_covariance(active, fit.variances, 6);
  out.covariance = X.covariance;
  out.covariance_target = Z.covariance;
  out.covariance_dof = X.dof;
}

/// A calibration in the stages of the pipeline.
struct HandEyeCalibration {
  using Place = RobustStart;

  HandEyeFit& fit;
  const HandEyeOptions& options;
  std::vector<double>& weights;
  double initial_rms = 0.0;

  std::vector<RobustStart> starts() const;
  fit::pipeline::Minimum<RobustStart> descend(const RobustStart& from) const { return {from, from.trimmed}; }
  void begin(const RobustStart& place);
  void find_noise() { fit.settle(options.max_iterations, false); }
  std::vector<double> probabilities();
  std::size_t fewest() const {
    return static_cast<std::size_t>(std::ceil(std::max(4.0, sound_part * static_cast<double>(weights.size()))));
  }
  double false_alarm() const { return options.outlier_false_alarm; }
  RobustStart place() const;
  fit::pipeline::Minimum<RobustStart> revisit(const RobustStart& from) const;
  bool same(const RobustStart& one, const RobustStart& other) const {
    return same_poses(one.poses, other.poses, fit.variances.lever);
  }
};

std::vector<RobustStart> HandEyeCalibration::starts() const {
  if (!options.start) return robust_starts(fit.mount(), fit.views(), fit.variances.lever);
  std::vector<ObservedView> views = fit.views();
  RobustStart out;
  out.poses = {*options.start, fixed_target(fit.mount(), *options.start, views)};
  choose_poses(fit.mount(), out.poses, views, fit.variances.lever);
  out.chosen = chosen_of(views);
  return {out};
}

std::vector<ObservedView> believing(std::vector<ObservedView> views, const std::vector<int>& chosen) {
  for (std::size_t i = 0; i < views.size(); ++i) views[i].chosen = chosen[i];
  return views;
}

/// A robust fit, then one pose of each target, and what is far off put out.
void HandEyeCalibration::begin(const RobustStart& place) {
  std::fill(weights.begin(), weights.end(), 1.0);
  fit.begin_at(place.poses, believing(fit.views(), place.chosen));
  first_variances(fit, options);
  initial_rms = whitened_rms(fit);
  fit.settle(options.max_iterations, true);
  choose_by_probability(fit);
  keep_the_nearest(fit);
}

std::vector<double> HandEyeCalibration::probabilities() {
  const auto inside = static_cast<double>(std::count(weights.begin(), weights.end(), 1.0));
  std::vector<double> out;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (weights[i] == 0) fit.restart(i);
    out.push_back(p_value(fit, i, inside));
  }
  return out;
}

RobustStart HandEyeCalibration::place() const { return {fit.poses(), chosen_of(fit.views()), 0.0}; }

/// All views, robust, with the variances that were found; the cost is that of a Student distribution, as the fit has
/// it.
fit::pipeline::Minimum<RobustStart> HandEyeCalibration::revisit(const RobustStart& from) const {
  constexpr double student = 4.0;
  HandEyeFit other(fit.mount(), fit.camera(), fit.views());
  other.begin_at(from.poses, believing(fit.views(), from.chosen));
  other.variances = fit.variances;
  other.variances.free = {false, false, false};
  other.settle(options.max_iterations, true);
  fit::pipeline::Minimum<RobustStart> out{{other.poses(), chosen_of(other.views()), 0.0}, 0.0};
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const auto view = other.linear(i);
    const double squared = view ? view->y.dot(other.variances.of(*view).ldlt().solve(view->y)) : 1e9;
    out.cost += (student + 6) * std::log1p(squared / student);
  }
  return out;
}

}  // namespace

void HandEyeOptions::validate() const {
  require(sigma_pixel >= 0, "sigma_pixel must not be negative [px]; 0 means estimated");
  require(sigma_robot_position >= 0, "sigma_robot_position must not be negative [m]; 0 means estimated");
  require(sigma_robot_rotation >= 0, "sigma_robot_rotation must not be negative [rad]; 0 means estimated");
  require(min_rotation > 0 && min_rotation < 3.14, "min_rotation must lie between 0 and pi [rad]");
  require(outlier_false_alarm >= 0 && outlier_false_alarm < 1, "outlier_false_alarm must lie in [0, 1) [-]");
  require(max_iterations >= 1, "max_iterations must be at least 1");
}

HandEyeResult calibrate_hand_eye(std::span<const HandEyeView> views, const Pinhole& camera,
                                 const HandEyeOptions& options) {
  check(views, camera, options);
  std::vector<ObservedView> observed_views;
  std::vector<std::size_t> index;
  for (std::size_t i = 0; i < views.size(); ++i) {
    ObservedView observed{.input = &views[i], .found = resect(views[i].view.points, views[i].view.pixels, camera)};
    if (observed.found.empty()) continue;
    observed_views.push_back(std::move(observed));
    index.push_back(i);
  }
  HandEyeResult out;
  out.mount = options.mount;
  HandEyeFit fit(options.mount, camera, std::move(observed_views));
  fit.variances.lever = usual_reach(views);
  std::string reason = "fewer than three views give a pose of the target";
  std::optional<fit::pipeline::Rival<RobustStart>> rival;
  if (index.size() >= 3) {
    HandEyeCalibration calibration{fit, options, fit.weights};
    rival = fit::pipeline::run(calibration);
    out.fit.initial_rms = calibration.initial_rms;
    reason = why_degenerate(fit, options);
    write_result(fit, out);
    out.fit.final_rms = whitened_rms(fit);
  }
  std::size_t k = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const bool has = k < index.size() && index[k] == i;
    out.views.push_back(report(fit, views[i], has && index.size() >= 3 ? std::optional(k) : std::nullopt));
    out.views.back().name = name_of_view(views, i);
    k += has;
  }
  out.fit.iterations = fit.iterations;
  out.fit.message = reason.empty() ? summary(fit, views, index) : reason;
  out.fit.status = !reason.empty() ? FitStatus::Degenerate
                   : fit.settled   ? FitStatus::Converged
                                   : FitStatus::MaxIterations;
  if (rival) {
    const auto inside = static_cast<double>(std::count(fit.weights.begin(), fit.weights.end(), 1.0));
    judge_second(*rival, std::max(6 * inside - 12, 1.0), "views", out);
  }
  return out;
}

}  // namespace kr5::calibration
