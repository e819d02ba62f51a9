// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/hand_eye_pairs.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <Eigen/Dense>

#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/fit/measurements/pose.hpp>
#include <kr5/fit/pipeline/pipeline.hpp>
#include <kr5/fit/problem.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "calibration/hand_eye/noise.hpp"
#include "calibration/hand_eye/second_pose.hpp"
#include "calibration/hand_eye/start.hpp"
#include "calibration/hand_eye_pairs/check_pairs.hpp"

namespace kr5::calibration {
namespace {

using namespace hand_eye;

constexpr double sound_pairs = 0.6;  // at least this part of the pairs stays in the fit
constexpr int most_rounds = 30;      // of fit and variances in turn
constexpr int steps_a_round = 6;     // of the variances

/// What one pair says of the two poses, to first order: y = e + n + F b, e the error of the robot pose, n that of the
/// camera's turn, seen at the flange.
LinearView linear_pair(const PosePair& pair, Mount mount, const Poses& at) {
  const Pose &T = pair.T_base_flange, &C = pair.T_camera_target;
  LinearView out;
  out.y = robot_residual(mount, at, T, C);
  const RobotDerivatives by = robot_derivatives(mount, at, C, out.y);
  out.F << -by.by_x, -by.by_z;
  out.U = by.by_target_seen.rightCols<3>() * by.by_target_seen.rightCols<3>().transpose();
  return out;
}

/// A calibration while it goes on, in the stages of the pipeline.
class PairsFit {
 public:
  using Place = RobustStart;

  std::vector<double> weights;

  PairsFit(std::span<const PosePair> pairs, const HandEyePairsOptions& options)
      : weights(pairs.size(), 1.0), pairs_(pairs), options_(options) {
    for (const PosePair& pair : pairs) stops_.push_back({.T_base_flange = pair.T_base_flange, .view = {}});
    variances_.lever = usual_reach(stops_);
  }

  std::vector<RobustStart> starts() const;
  fit::pipeline::Minimum<RobustStart> descend(const RobustStart& from) const { return {from, from.trimmed}; }
  void begin(const RobustStart& place);
  /// Poses and free variances in turn, until the variances no longer change.
  void find_noise();
  std::vector<double> probabilities() const;
  std::size_t fewest() const { return std::max<std::size_t>(least(), 4); }
  double false_alarm() const { return options_.outlier_false_alarm; }
  RobustStart place() const { return {poses_, std::vector<int>(pairs_.size(), 0), 0.0}; }
  fit::pipeline::Minimum<RobustStart> revisit(const RobustStart& from) const;
  bool same(const RobustStart& one, const RobustStart& other) const {
    return same_poses(one.poses, other.poses, variances_.lever);
  }

  /// Degrees of freedom of the noise.
  double dof() const { return std::max(6.0 * static_cast<double>(inside()) - 12, 1.0); }
  void write(HandEyeResult& out) const;

 private:
  void first_variances();
  void exclude_far();
  void fit(double loss = 0.0);

  LinearView linear(std::size_t i) const { return linear_pair(pairs_[i], options_.mount, poses_); }
  double squared(std::size_t i) const {
    const LinearView view = linear(i);
    return view.y.dot(variances_.of(view).ldlt().solve(view.y));
  }
  std::vector<WeightedView> active() const {
    std::vector<WeightedView> out;
    for (std::size_t i = 0; i < pairs_.size(); ++i)
      if (weights[i] > 0) out.push_back({linear(i), 1.0});
    return out;
  }
  std::size_t inside() const { return static_cast<std::size_t>(std::count(weights.begin(), weights.end(), 1.0)); }
  std::size_t least() const {
    return std::max<std::size_t>(3,
                                 static_cast<std::size_t>(std::ceil(sound_pairs * static_cast<double>(pairs_.size()))));
  }
  double probability(std::size_t i) const;

  std::span<const PosePair> pairs_;
  const HandEyePairsOptions& options_;
  std::vector<HandEyeView> stops_;
  Poses poses_;
  Variances variances_;  ///< Of position, of the robot's turn, of the camera's turn.
  std::optional<fit::Problem> fit_;
  std::vector<fit::FitMeasurement> seen_;
  fit::Solution result_;
  bool regular_ = false, settled_ = false;
  int iterations_ = 0;
  double initial_rms_ = 0.0;
};

std::vector<RobustStart> PairsFit::starts() const {
  std::vector<ObservedView> observed;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    Resection seen;
    seen.T_camera_points = pairs_[i].T_camera_target;
    observed.push_back({.input = &stops_[i], .found = {seen}});
  }
  return robust_starts(options_.mount, std::move(observed), variances_.lever);
}

void PairsFit::begin(const RobustStart& place) {
  poses_ = place.poses;
  weights.assign(weights.size(), 1.0);
  iterations_ = 0;
  first_variances();
  exclude_far();
}

/// All pairs, robust, with the variances that were found.
fit::pipeline::Minimum<RobustStart> PairsFit::revisit(const RobustStart& from) const {
  PairsFit other(pairs_, options_);
  other.poses_ = from.poses;
  other.variances_ = variances_;
  other.fit(2.0);
  return {other.place(), other.result_.cost};
}

void PairsFit::first_variances() {
  std::vector<double> position, rotation;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const Vector6 y = linear(i).y;
    position.push_back(y.head<3>().squaredNorm() / 3), rotation.push_back(y.tail<3>().squaredNorm() / 3);
  }
  const double given[] = {options_.sigma_position, options_.sigma_robot_rotation, options_.sigma_camera_rotation};
  const double turn = std::max(median(rotation) / 2, 1e-14);
  variances_.value << std::max(median(position), 1e-14), turn, turn;
  for (int k = 0; k < 3; ++k) {
    variances_.free[static_cast<std::size_t>(k)] = given[k] == 0;
    if (given[k] > 0) variances_.value[k] = given[k] * given[k];
  }
}

/// What the robust start found far off is left out; the tests that follow decide.
void PairsFit::exclude_far() {
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < pairs_.size(); ++i) order.emplace_back(squared(i), i);
  std::sort(order.begin(), order.end());
  const double scale = std::max(order[order.size() / 2].first / uncertainty::chi_square_quantile(0.5, 6), 1e-12);
  for (std::size_t k = least(); k < order.size(); ++k)
    if (order[k].first > scale * uncertainty::chi_square_quantile(0.9999, 6)) weights[order[k].second] = 0.0;
}

/// The two poses at the present variances.
void PairsFit::fit(double loss) {
  const Eigen::Vector3d sigma = variances_.value.cwiseSqrt();
  // Robot and camera share the position noise; which of them has it makes no difference.
  const double position = sigma[0] / std::sqrt(2.0);
  fit_.emplace();
  seen_.clear();
  const fit::FitBlock camera = fit_->add_pose("camera", poses_.X), target = fit_->add_pose("target", poses_.Z);
  Vector6 prior;
  prior << Eigen::Vector3d::Constant(position), Eigen::Vector3d::Constant(sigma[1]);
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const fit::FitBlock error = fit_->add_nuisance_pose("robot " + std::to_string(i));
    fit_->set_prior(error, prior);
    const Pose& T = pairs_[i].T_base_flange;
    fit::PoseChain chain;
    chain.then_inverse(camera);
    if (options_.mount == Mount::EyeInHand)
      chain.then_inverse(error).then(T.inverse());
    else
      chain.then(T).then(error);
    seen_.push_back(fit_->add(fit::PoseMeasurement(chain.then(target), pairs_[i].T_camera_target, position, sigma[2])));
    fit_->set_weight(seen_.back(), weights[i]);
  }
  result_ = fit_->solve({.max_iterations = options_.max_iterations, .loss = loss, .uncertainty = loss == 0});
  iterations_ += result_.fit.iterations;
  poses_ = {fit_->pose(camera), fit_->pose(target)};
}

void PairsFit::find_noise() {
  settled_ = false;
  for (int round = 0; round < most_rounds && !settled_; ++round) {
    fit();
    if (iterations_ == result_.fit.iterations) initial_rms_ = result_.fit.initial_rms;
    const Eigen::Vector3d before = variances_.value;
    const std::vector<WeightedView> views = active();
    estimate_variances(views, variances_, steps_a_round);
    regular_ = solve(views, variances_).regular;
    settled_ = (variances_.value.cwiseQuotient(before).array() - 1).abs().maxCoeff() < 1e-2;
  }
}

/// Probability that a sound pair lies as far from what the others say.
double PairsFit::probability(std::size_t i) const {
  const fit::Agreement agreement = result_.agreement(*fit_, seen_[i]);
  const bool known = !variances_.free[0] && !variances_.free[1] && !variances_.free[2];
  // Position and rotation noise are each estimated from half of the readings: of a pair outside, which few others may
  // have agreed to leave out, that counts.
  const double numbers = static_cast<double>(inside());
  const double dof = std::max(weights[i] > 0 ? 6 * numbers - 12 : 3 * numbers - 6, 7.0);
  return fit::pipeline::sound_probability(agreement.squared_distance, agreement.dof, weights[i] > 0,
                                          known ? uncertainty::known_noise : dof);
}

std::vector<double> PairsFit::probabilities() const {
  std::vector<double> out;
  for (std::size_t i = 0; i < pairs_.size(); ++i) out.push_back(probability(i));
  return out;
}

void PairsFit::write(HandEyeResult& out) const {
  out.mount = options_.mount;
  out.T_mount_camera = poses_.X;
  out.T_fixed_target = poses_.Z;
  const std::vector<WeightedView> views = active();
  const WidenedCovariance X = widened_covariance(views, variances_, 0), Z = widened_covariance(views, variances_, 6);
  out.covariance = X.covariance;
  out.covariance_target = Z.covariance;
  out.covariance_dof = X.dof;
  const Eigen::Vector3d sigma = variances_.value.cwiseSqrt();
  out.sigma_robot_position = sigma[0], out.sigma_robot_rotation = sigma[1], out.sigma_camera_rotation = sigma[2];
  std::vector<Pose> turned;
  std::string outliers;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const Vector6 y = linear(i).y;
    out.views.push_back({.name = name_of_pair(pairs_, i),
                         .robot_position = y.head<3>().norm(),
                         .robot_rotation = y.tail<3>().norm(),
                         .weight = weights[i],
                         .outlier = weights[i] == 0});
    if (weights[i] > 0)
      turned.push_back(pairs_[i].T_base_flange);
    else
      outliers += (outliers.empty() ? "" : ", ") + out.views.back().name;
  }
  out.fit = result_.fit;
  out.fit.initial_rms = initial_rms_;
  out.fit.iterations = iterations_;
  std::string reason = turn_shortage(turned, options_.min_rotation);
  if (reason.empty() && !(regular_ && result_.unidentifiable.empty()))
    reason = "the pairs do not determine all twelve parameters of the two poses";
  out.fit.status = !reason.empty() ? FitStatus::Degenerate : settled_ ? FitStatus::Converged : FitStatus::MaxIterations;
  out.fit.message = !reason.empty() ? reason
                                    : std::to_string(pairs_.size()) + " pairs of poses" +
                                          (outliers.empty() ? "" : "; contradict the others: " + outliers);
}

}  // namespace

void HandEyePairsOptions::validate() const {
  require(sigma_position >= 0, "sigma_position must not be negative [m]; 0 means estimated");
  require(sigma_robot_rotation >= 0, "sigma_robot_rotation must not be negative [rad]; 0 means estimated");
  require(sigma_camera_rotation >= 0, "sigma_camera_rotation must not be negative [rad]; 0 means estimated");
  require(min_rotation > 0 && min_rotation < 3.14, "min_rotation must lie between 0 and pi [rad]");
  require(outlier_false_alarm >= 0 && outlier_false_alarm < 1, "outlier_false_alarm must lie in [0, 1) [-]");
  require(max_iterations >= 1, "max_iterations must be at least 1");
}

HandEyeResult calibrate_hand_eye_pairs(std::span<const PosePair> pairs, const HandEyePairsOptions& options) {
  options.validate();
  check_pairs(pairs);
  HandEyeResult out;
  PairsFit fit(pairs, options);
  const auto rival = fit::pipeline::run(fit);
  fit.write(out);
  if (rival) judge_second(*rival, fit.dof(), "pairs of poses", out);
  return out;
}

}  // namespace kr5::calibration
