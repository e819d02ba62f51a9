// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/scanner.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>

#include <Eigen/Dense>
#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/fit/pipeline/pipeline.hpp>
#include <kr5/fit/pipeline/second_minimum.hpp>
#include <kr5/fit/pipeline/sound_probability.hpp>
#include <kr5/fit/variance_component.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "calibration/parameters/parameter_report.hpp"
#include "calibration/scanner/scanner_causes.hpp"
#include "calibration/scanner/scanner_problem.hpp"
#include "calibration/scanner/scanner_search.hpp"
#include "calibration/scanner/scanner_start.hpp"

namespace kr5::calibration {
namespace {

using namespace scanner_problem;

constexpr double sound_profiles = 0.6;  // at least this part of the profiles stays in the fit
constexpr double min_error = 1e-7;      // of a profile, where nothing scatters [m]
constexpr int sigma_rounds = 40, tips_for_across = 15;
constexpr double useless_position = 0.01, useless_rotation = 0.035;  // standard deviation of a pose [m, rad]

void check_target(const ScanTarget& target) {
  const std::string where = "target " + target.name + ": ";
  require(!target.name.empty(), "a target has no name");
  require(target.radius >= 0 && target.radius < 1, where + "radius must lie between 0 and 1 m; is it in millimetres?");
  require(target.sigma >= 0, where + "sigma must not be negative [m]");
  require(!target.position || target.position->allFinite(), where + "position must be finite [m]");
  if (target.kind != ScanTargetKind::Plane) return;
  require(target.position.has_value() == target.normal.has_value(), where + "a known plane needs position and normal");
  require(!target.normal || std::abs(target.normal->norm() - 1) < 1e-6, where + "normal must have unit length");
}

void check_view(const ScannerView& view, std::size_t row, const ScanTarget& target,
                const std::optional<kinematics::DhChain>& arm) {
  const std::string where = "profile " + (view.name.empty() ? std::to_string(row) : view.name) + ": ";
  const ProfileFeature& feature = view.feature;
  require(feature.kind == target.kind, where + "shows a " + std::string(name_of(feature.kind)) + ", but target " +
                                           target.name + " is a " + std::string(name_of(target.kind)));
  const bool plane = target.kind == ScanTargetKind::Plane;
  const Eigen::Index numbers = target.kind == ScanTargetKind::Sphere ? 3 : 2;
  require(feature.fit.usable() && feature.points.cols() == (plane ? 2 : 1) && feature.points.allFinite() &&
              feature.covariance.rows() == numbers && feature.covariance.cols() == numbers &&
              feature.covariance.allFinite() && (target.kind != ScanTargetKind::Sphere || feature.radius > 0),
          where + "has no usable feature; leave it out");
  require(view.T_base_flange.matrix().allFinite() && is_rotation(view.T_base_flange.linear(), 1e-3),
          where + "T_base_flange has no proper rotation");
  require(view.T_base_flange.translation().norm() < 100,
          where + "the flange lies more than 100 m away; is it in millimetres?");
  if (arm)
    require(view.q.size() == static_cast<Eigen::Index>(arm->joints.size()) && view.q.allFinite(),
            where + "found " + std::to_string(view.q.size()) + " joint values, the arm has " +
                std::to_string(arm->joints.size()) + " joints");
}

ScannerInput checked_scanner_input(std::span<const ScannerView> views, std::span<const ScanTarget> targets,
                                   const ScannerOptions& options, const std::optional<kinematics::DhChain>& arm) {
  options.validate();
  require(views.size() >= 4, "scanner calibration needs at least four profiles, found " + std::to_string(views.size()));
  ScannerInput input{views, targets, options, arm, {}, {}};
  std::map<std::string, std::size_t> known;
  for (std::size_t k = 0; k < targets.size(); ++k) {
    check_target(targets[k]);
    require(known.emplace(targets[k].name, k).second, "target " + targets[k].name + ": is listed twice");
  }
  std::set<std::size_t> seen;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto at = known.find(views[i].target);
    require(at != known.end(), "profile " + std::to_string(i) + ": there is no target '" + views[i].target + "'");
    check_view(views[i], i, targets[at->second], arm);
    input.target_of.push_back(at->second);
    input.T_base_flange.push_back(arm ? arm->flange(views[i].q) : views[i].T_base_flange);
    seen.insert(at->second);
  }
  for (std::size_t k = 0; k < targets.size(); ++k)
    require(seen.contains(k), "target " + targets[k].name + ": no profile shows it");
  return input;
}

struct ScannerComponents {
  fit::VarianceComponent position, across, length, angle;
  double redundancy = 0.0;
};

/// The calibration while it goes on, in the stages of the pipeline.
struct ScannerCalibration {
  using Place = ScannerPlacement;

  const ScannerInput& input;
  std::vector<double> weights;
  ScannerSigmas sigmas = {};
  ScannerPlacement start = {};
  std::optional<ScannerProblem> problem = {};
  fit::Solution result = {};
  bool across_apart = false;
  int iterations = 0;

  std::vector<ScannerPlacement> starts() const;
  fit::pipeline::Minimum<ScannerPlacement> descend(const ScannerPlacement& from) const;
  void begin(const ScannerPlacement& place);
  std::size_t fewest() const {
    return static_cast<std::size_t>(std::ceil(sound_profiles * static_cast<double>(weights.size())));
  }
  double false_alarm() const { return input.options.outlier_false_alarm; }
  ScannerPlacement place() const { return problem->placement(input); }
  fit::pipeline::Minimum<ScannerPlacement> revisit(const ScannerPlacement& from) const;
  bool same(const ScannerPlacement& one, const ScannerPlacement& other) const;

  void fit(double loss = 0.0) {
    ScannerProblem next(input, sigmas, problem ? problem->placement(input) : start);
    if (problem) next.begin_at(*problem);
    next.set_weights(weights);
    problem.emplace(std::move(next));
    result =
        problem->fit.solve({.max_iterations = input.options.max_iterations, .loss = loss, .uncertainty = loss == 0});
    iterations += result.fit.iterations;
  }
  void robust_fit();
  void exclude_far_profiles();
  ScannerComponents components() const;
  bool update_sigmas();
  void find_noise() {
    for (int round = 0; round < sigma_rounds; ++round) {
      fit();
      if (!update_sigmas()) break;
    }
  }
  double dof() const { return std::max(1.0, components().redundancy); }
  double probability(std::size_t i, double degrees) const {
    const fit::Agreement agreement = result.agreement(problem->fit, problem->observations[i]);
    return fit::pipeline::sound_probability(agreement.squared_distance, agreement.dof, weights[i] > 0,
                                            input.options.sigma_position > 0 ? uncertainty::known_noise : degrees);
  }
  std::vector<double> probabilities() const {
    std::vector<double> out;
    const double degrees = dof();
    for (std::size_t i = 0; i < weights.size(); ++i) out.push_back(probability(i, degrees));
    return out;
  }
};

/// A robust fit, whose scale shrinks with what it explains.
void ScannerCalibration::robust_fit() {
  for (int round = 0; round < 3; ++round) {
    fit(2.0);
    std::vector<double> sizes;
    for (std::size_t i = 0; i < weights.size(); ++i)
      for (const double r : problem->residuals(i)) sizes.push_back(std::abs(r));
    sigmas.position = sigmas.across = std::max(mad_to_sigma * median(sizes), min_error);
  }
}

/// What the robust fit found far off is put out; the tests that follow decide.
void ScannerCalibration::exclude_far_profiles() {
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < weights.size(); ++i) order.emplace_back(problem->distance(i), i);
  std::sort(order.begin(), order.end());
  const double scale = std::max(order[order.size() / 2].first, 10 * min_error);
  const auto least = static_cast<std::size_t>(std::ceil(sound_profiles * static_cast<double>(weights.size())));
  for (std::size_t k = least; k < order.size(); ++k)
    if (order[k].first > 3 * scale) weights[order[k].second] = 0.0;  // beyond about four sigma
}

ScannerComponents ScannerCalibration::components() const {
  ScannerComponents out;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (!(weights[i] > 0)) continue;
    const fit::Agreement agreement = result.agreement(problem->fit, problem->observations[i]);
    const bool tip = input.views[i].feature.kind == ScanTargetKind::Tip;
    for (Eigen::Index k = 0; k < agreement.residuals.size(); ++k) {
      // A residual tells of the error of the profile as far as its variance comes from there.
      const double share = problem->shares[i][k];
      (tip && k == 1 && across_apart ? out.across : out.position)
          .add(std::sqrt(share) * agreement.residuals[k], share * agreement.redundancy[k]);
      out.redundancy += agreement.redundancy[k];
    }
  }
  if (!input.arm) return out;
  const Eigen::VectorXd change = problem->fit.change(problem->arm),
                        share = result.prior_redundancy(problem->fit, problem->arm);
  for (Eigen::Index k = 0; k < change.size(); ++k) {
    const bool length = k % 5 == 0 || k % 5 == 2;
    (length ? out.length : out.angle).add(change[k] / (length ? sigmas.length : sigmas.angle), share[k]);
  }
  return out;
}

bool ScannerCalibration::update_sigmas() {
  const ScannerComponents c = components();
  const ScannerOptions& options = input.options;
  bool moving = false;
  if (!(options.sigma_position > 0)) moving = c.position.update(sigmas.position, min_error) || moving;
  if (options.sigma_across > 0)
    sigmas.across = options.sigma_across;
  else if (across_apart)
    moving = c.across.update(sigmas.across, min_error) || moving;
  else
    sigmas.across = sigmas.position;
  if (!input.arm) return moving;
  if (!(options.tolerance_length > 0)) moving = c.length.update(sigmas.length, 1e-6) || moving;
  if (!(options.tolerance_angle > 0)) moving = c.angle.update(sigmas.angle, 1e-6) || moving;
  return moving;
}

double median_size(const ScannerProblem& problem, std::size_t views) {
  std::vector<double> sizes;
  for (std::size_t i = 0; i < views; ++i) sizes.push_back(problem.distance(i));
  return median(sizes);
}

/// Closed forms, and where a search from rotations all over ended.
std::vector<ScannerPlacement> ScannerCalibration::starts() const {
  std::vector<ScannerPlacement> out;
  for (const Pose& T : scanner_starts(input)) out.push_back(place_targets(input, T));
  for (const Pose& T : searched_poses(input)) out.push_back(place_targets(input, T));
  return out;
}

/// A robust fit of scanner and targets; the cost is the median distance.
fit::pipeline::Minimum<ScannerPlacement> ScannerCalibration::descend(const ScannerPlacement& from) const {
  ScannerSigmas rough;
  rough.position = rough.across = std::max(median_distance(input, from.T_flange_scanner), 1e-5);
  ScannerProblem descent(input, rough, from);
  if (input.arm) descent.fit.hold(descent.arm);
  descent.fit.solve({.max_iterations = 50, .loss = 2.0, .uncertainty = false});
  return {descent.placement(input), median_size(descent, input.views.size())};
}

/// A robust fit from there, whose noise is what the profiles show of it, unless it is given.
void ScannerCalibration::begin(const ScannerPlacement& place) {
  const ScannerOptions& options = input.options;
  problem.reset();
  start = place;
  weights.assign(weights.size(), 1.0);
  sigmas = {};
  const ScannerProblem there(input, sigmas, place);
  sigmas.position = sigmas.across = std::max(median_size(there, weights.size()), min_error);
  sigmas.rotation = options.sigma_rotation;
  if (options.tolerance_length > 0) sigmas.length = options.tolerance_length;
  if (options.tolerance_angle > 0) sigmas.angle = options.tolerance_angle;
  robust_fit();
  if (options.sigma_position > 0) sigmas.position = sigmas.across = options.sigma_position;
  if (options.sigma_across > 0) sigmas.across = options.sigma_across;
  exclude_far_profiles();
}

/// All profiles, robust, with the noise that was found.
fit::pipeline::Minimum<ScannerPlacement> ScannerCalibration::revisit(const ScannerPlacement& from) const {
  ScannerProblem descent(input, sigmas, from);
  const double cost =
      descent.fit.solve({.max_iterations = input.options.max_iterations, .loss = 2.0, .uncertainty = false}).cost;
  return {descent.placement(input), cost};
}

/// Whether two poses lie within what the profiles leave open anyway.
bool ScannerCalibration::same(const ScannerPlacement& one, const ScannerPlacement& other) const {
  Matrix6 C = parameters::covariance_of_pose(result, problem->scanner, result.covariance);
  if (!C.allFinite()) return true;  // no pose is determined
  C.diagonal().head<3>().array() += 1e-10, C.diagonal().tail<3>().array() += 1e-8;
  const Vector6 d = pose_difference(one.T_flange_scanner, other.T_flange_scanner);
  return d.dot(C.ldlt().solve(d)) < uncertainty::chi_square_quantile(1 - 1e-6, 6);
}

/// Predicts each part of the profiles from the others.
void leave_out(const ScannerCalibration& calibration, ScannerResult& out) {
  const ScannerInput& input = calibration.input;
  const int folds = std::min<int>(input.options.folds, static_cast<int>(input.views.size()));
  if (folds < 2) return;
  std::vector<int> fold(input.views.size()), count(input.targets.size(), 0);
  for (std::size_t i = 0; i < fold.size(); ++i) fold[i] = count[input.target_of[i]]++ % folds;
  double squares = 0.0, sound = 0.0;
  for (int part = 0; part < folds; ++part) {
    ScannerProblem problem(input, calibration.sigmas, calibration.problem->placement(input));
    problem.begin_at(*calibration.problem);
    std::vector<double> weights = calibration.weights;
    std::vector<int> left(input.targets.size(), 0);
    for (std::size_t i = 0; i < weights.size(); ++i) {
      if (fold[i] == part) weights[i] = 0.0;
      left[input.target_of[i]] += weights[i] > 0;
    }
    if (std::count(weights.begin(), weights.end(), 1.0) < 4) continue;
    problem.set_weights(weights);
    problem.fit.solve({.max_iterations = input.options.max_iterations});
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const bool placed = left[input.target_of[i]] >= 2 || input.target(i).position.has_value();
      if (fold[i] != part || !placed) continue;
      out.views[i].held_out = problem.distance(i);
      if (calibration.weights[i] > 0) squares += std::pow(out.views[i].held_out, 2), sound += 1;
    }
  }
  if (sound > 0) out.held_out_rms = std::sqrt(squares / sound);
}

void write_scanner_parameters(const ScannerCalibration& calibration, ScannerResult& out) {
  const ScannerProblem& problem = *calibration.problem;
  const fit::FitBlock nominal[] = {problem.arm};
  std::vector<fit::FitBlock> others = {problem.scanner};
  others.insert(others.end(), problem.targets.begin(), problem.targets.end());
  others.insert(others.end(), problem.radii.begin(), problem.radii.end());
  parameters::ParameterReport report = parameters::report_parameters(
      problem.fit, calibration.result, nominal, others, parameters::same_inflation(calibration.result, 1, out.dof));
  out.coordinates = std::move(report.parameters);
  out.joint_covariance = std::move(report.covariance);
  out.covariance = uncertainty::covariance_inflation(6, out.dof) *
                   parameters::covariance_of_pose(calibration.result, problem.scanner, calibration.result.covariance);
}

void write_scanner_views(const ScannerCalibration& calibration, ScannerResult& out) {
  const ScannerInput& input = calibration.input;
  const std::vector<double> sound = calibration.probabilities();
  double squares = 0.0, used = 0.0;
  for (std::size_t i = 0; i < input.views.size(); ++i) {
    ScannerViewReport& report = out.views.emplace_back();
    report.name = input.views[i].name.empty() ? std::to_string(i) : input.views[i].name;
    report.target = input.views[i].target;
    report.distance = calibration.problem->distance(i);
    report.probability = sound[i];
    report.outlier = calibration.weights[i] == 0;
    if (!report.outlier) squares += report.distance * report.distance, used += 1;
  }
  out.rms = std::sqrt(squares / std::max(used, 1.0));
}

void write_targets(const ScannerCalibration& calibration, ScannerResult& out) {
  const ScannerPlacement placement = calibration.problem->placement(calibration.input);
  for (std::size_t k = 0; k < placement.targets.size(); ++k) {
    ScanTarget& target = out.targets.emplace_back(calibration.input.targets[k]);
    target.position = placement.targets[k].position;
    target.radius = target.kind == ScanTargetKind::Sphere ? placement.targets[k].radius : 0.0;
    if (target.kind == ScanTargetKind::Plane) target.normal = placement.targets[k].T_base_plane.linear().col(2);
  }
}

/// Standard deviations of the least certain directions of position [m] and orientation [rad].
std::pair<double, double> worst_deviations(const Matrix6& covariance) {
  const auto worst = [](const Eigen::Matrix3d& C) {
    return std::sqrt(std::max(0.0, symmetric_eigen(C).values.maxCoeff()));
  };
  return {worst(covariance.topLeftCorner<3, 3>()), worst(covariance.bottomRightCorner<3, 3>())};
}

/// Refuses a pose that the profiles leave open, and says in which direction.
void judge_determination(const ScannerInput& input, ScannerResult& out) {
  std::string open;
  for (const fit::UnidentifiableDirection& direction : out.unidentifiable) {
    // What the arm takes part in is held by the spread about its nominal values.
    if (direction.involves("scanner") && !direction.involves("arm"))
      open += (open.empty() ? "" : "; ") + direction.text;
  }
  const auto [position, rotation] = worst_deviations(out.covariance);
  if (open.empty() && position < useless_position && rotation < useless_rotation) return;
  out.fit.status = FitStatus::Degenerate;
  char text[160];
  std::snprintf(text, sizeof text, "it is known to no better than %.0f mm and %.1f deg", 1e3 * position,
                57.29577951308232 * rotation);
  if (const auto cause = missing_turn(input)) out.causes.push_back(*cause);
  out.fit.message = "the profiles do not determine the pose of the scanner: ";
  out.fit.message += open.empty() ? text : open;
  out.fit.message += out.causes.empty() ? "; " + missing_variety(input)
                                        : "; " + out.causes.back().text + "; " + out.causes.back().remedy;
}

/// Tells another pose that is near the result in its cost, and refuses both where they cannot be told apart.
void judge_rival(const ScannerCalibration& calibration, const fit::pipeline::Rival<ScannerPlacement>& rival,
                 ScannerResult& out) {
  out.second = fit::pipeline::second_minimum(calibration.place().T_flange_scanner, rival.at.T_flange_scanner,
                                             rival.best_cost, rival.cost, out.dof);
  fit::pipeline::refuse_undecided(out.second, "two poses of the scanner explain the profiles",
                                  missing_variety(calibration.input), out.fit);
}

}  // namespace

void ScannerOptions::validate() const {
  require(sigma_position >= 0, "sigma_position must not be negative [m]; 0 means estimated");
  require(sigma_across >= 0, "sigma_across must not be negative [m]; 0 means estimated");
  require(sigma_rotation >= 0, "sigma_rotation must not be negative [rad]");
  require(tolerance_length >= 0, "tolerance_length must not be negative [m]; 0 means estimated");
  require(tolerance_angle >= 0, "tolerance_angle must not be negative [rad]; 0 means estimated");
  require(outlier_false_alarm >= 0 && outlier_false_alarm < 1, "outlier_false_alarm must lie in [0, 1) [-]");
  require(folds >= 0, "folds must not be negative");
  require(max_iterations >= 1, "max_iterations must be at least 1");
  require(
      !T_flange_scanner || (T_flange_scanner->matrix().allFinite() && is_rotation(T_flange_scanner->linear(), 1e-3)),
      "T_flange_scanner has no proper rotation");
}

ScannerResult calibrate_scanner(std::span<const ScannerView> views, std::span<const ScanTarget> targets,
                                const ScannerOptions& options, const std::optional<kinematics::DhChain>& arm) {
  const ScannerInput input = checked_scanner_input(views, targets, options, arm);
  ScannerCalibration calibration{input, std::vector<double>(views.size(), 1.0)};
  const auto tips = std::count_if(views.begin(), views.end(),
                                  [](const ScannerView& v) { return v.feature.kind == ScanTargetKind::Tip; });
  calibration.across_apart = tips >= tips_for_across && !(options.sigma_position > 0 && !(options.sigma_across > 0));
  const auto rival = fit::pipeline::run(calibration);

  ScannerResult out;
  const ScannerProblem& problem = *calibration.problem;
  out.T_flange_scanner = problem.fit.pose(problem.scanner);
  if (arm) out.arm = problem.fit.arm(problem.arm);
  out.unidentifiable = calibration.result.unidentifiable;
  out.sigma_position = calibration.sigmas.position;
  out.sigma_across = calibration.sigmas.across;
  if (arm) out.tolerance_length = calibration.sigmas.length, out.tolerance_angle = calibration.sigmas.angle;
  out.dof = options.sigma_position > 0 ? uncertainty::known_noise : calibration.dof();
  out.fit = calibration.result.fit;
  out.fit.iterations = calibration.iterations;
  write_scanner_parameters(calibration, out);
  write_scanner_views(calibration, out);
  write_targets(calibration, out);
  judge_determination(input, out);
  if (rival) judge_rival(calibration, *rival, out);
  find_data_causes(input, calibration.weights, out);
  if (out.fit.usable()) leave_out(calibration, out);
  return out;
}

}  // namespace kr5::calibration
