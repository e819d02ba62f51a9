// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/kinematics.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/fit/pipeline/pipeline.hpp>
#include <kr5/fit/pipeline/second_minimum.hpp>
#include <kr5/fit/pipeline/sound_probability.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "calibration/kinematics/arm_problem.hpp"
#include "calibration/parameters/parameter_report.hpp"
#include "calibration/postures/measured_place.hpp"

namespace kr5::calibration {
namespace {

using namespace arm_problem;

constexpr double sound_postures = 0.6;      // at least this part of the postures stays in the fit
constexpr double variances_settled = 1e-3;  // relative change of the standard deviations at which they count as found
constexpr double refit_from = 0.02;         // relative change of one from which another fit is needed
constexpr int variance_rounds = 1000, most_refits = 40;
constexpr double min_noise_dof = 5.0;  // with fewer an estimated noise says little, and may vanish

void check_posture(const ArmPosture& posture, std::size_t row, std::size_t joints) {
  check_joint_values(posture, row, joints);
  const std::string where = "posture " + (posture.name.empty() ? std::to_string(row) : posture.name) + ": ";
  require(posture.T_world_tool || any_seen(posture.points) || !posture.socket.empty() || posture.pixels.cols() > 0,
          where + "nothing was measured of it");
  require(posture.pixels.cols() == posture.target_points.cols(),
          where + "found " + std::to_string(posture.pixels.cols()) + " pixels of " +
              std::to_string(posture.target_points.cols()) + " target points");
  require(posture.pixels.allFinite() && posture.target_points.allFinite(), where + "pixels must be finite");
  require(!posture.points.array().isInf().any(), where + "points must be finite, or NaN where not seen");
  if (!posture.T_world_tool) return;
  require(posture.T_world_tool->matrix().allFinite() && is_rotation(posture.T_world_tool->linear(), 1e-3),
          where + "T_world_tool has no proper rotation");
}

Input checked_input(const kinematics::DhChain& nominal, std::span<const ArmPosture> postures,
                    std::span<const SocketDistance> distances, const KinematicsOptions& options) {
  options.validate();
  require(!nominal.joints.empty(), "the arm has no joints");
  require(postures.size() >= 6,
          "kinematic calibration needs at least six postures, found " + std::to_string(postures.size()));
  std::set<std::string> sockets;
  for (std::size_t i = 0; i < postures.size(); ++i) {
    check_posture(postures[i], i, nominal.joints.size());
    if (!postures[i].socket.empty()) sockets.insert(postures[i].socket);
  }
  Input input{nominal, postures, distances, options, {sockets.begin(), sockets.end()}};
  require(!input.any_view() || (options.camera && options.T_flange_camera && options.T_base_target),
          "postures with pixels need camera, T_flange_camera and T_base_target");
  for (std::size_t i = 0; i < postures.size() && options.elasticity; ++i)
    require(postures[i].torques.size() == postures[i].q.size() && postures[i].torques.allFinite(),
            "elasticity: a posture has no finite torque for each joint (posture " + std::to_string(i) + ")");
  for (const SocketDistance& d : distances) {
    require(d.distance > 0 && d.sigma > 0, "a distance of sockets and its sigma must be positive [m]");
    input.socket(d.first), input.socket(d.second);
  }
  return input;
}

/// Coordinates of one prior, whose standard deviation is estimated.
struct PriorGroup {
  double* sigma = nullptr;
  double given = 0.0, least = 1e-6;
  std::vector<int> places;
  std::vector<double> changes;
  double redundancy = 0.0;

  double weight() const { return 1 / (*sigma * *sigma); }
};

/// Measurements of one kind, whose noise is estimated.
struct NoiseGroup {
  double* sigma = nullptr;
  double given = 0.0, least = 1e-9;
  fit::SquaredResiduals sum;  ///< Whitened by the noise of the fit.
  double scale = 1.0;         ///< Of the noise now over that of the fit.
  double redundancy = 0.0;

  double weight() const { return 1 / (scale * scale); }
};

/// The fit near its solution, as a function of the standard deviations that it assumed: they may be estimated to the
/// end without another fit (restricted maximum likelihood by Förstner's iteration).
struct VarianceModel {
  std::vector<NoiseGroup> noises;
  std::vector<PriorGroup> priors;
  Eigen::MatrixXd fixed;  ///< Information of what has a known standard deviation.
  Eigen::VectorXd fixed_gradient;

  /// One step of the iteration; the greatest change of the logarithm of a standard deviation.
  double step();
  /// Degrees of freedom behind the variance of each coordinate, whose noises and priors are estimated from finite data
  /// (Satterthwaite 1946).
  Eigen::VectorXd degrees_of_freedom() const;

 private:
  Eigen::MatrixXd information() const;
};

Eigen::MatrixXd VarianceModel::information() const {
  Eigen::MatrixXd out = fixed;
  for (const NoiseGroup& noise : noises)
    if (noise.sum.rows > 0) out += noise.weight() * noise.sum.information;
  for (const PriorGroup& prior : priors)
    for (const int place : prior.places) out(place, place) += prior.weight();
  return out;
}

Eigen::VectorXd VarianceModel::degrees_of_freedom() const {
  const Eigen::MatrixXd C = covariance_of(information(), fit::SolveOptions().rank_tolerance);
  // Variance of the estimated variances, 2 / redundancy of each relative one, carried to those of the coordinates.
  Eigen::VectorXd doubt = Eigen::VectorXd::Zero(C.rows());
  for (const NoiseGroup& noise : noises) {
    if (noise.sum.rows == 0 || noise.given > 0) continue;
    const Eigen::VectorXd share = noise.weight() * (C * noise.sum.information).cwiseProduct(C).rowwise().sum();
    doubt += share.cwiseAbs2() / std::max(noise.redundancy, 1.0);
  }
  for (const PriorGroup& prior : priors) {
    if (prior.given > 0 || prior.places.empty()) continue;
    Eigen::VectorXd share = Eigen::VectorXd::Zero(C.rows());
    for (const int place : prior.places) share += prior.weight() * C.col(place).cwiseAbs2();
    doubt += share.cwiseAbs2() / std::max(prior.redundancy, 1.0);
  }
  return C.diagonal()
      .cwiseAbs2()
      .cwiseQuotient(doubt.cwiseMax(1e-300))
      .cwiseMin(uncertainty::known_noise)
      .cwiseMax(1.0);
}

double VarianceModel::step() {
  Eigen::VectorXd gradient = fixed_gradient;
  for (const NoiseGroup& noise : noises)
    if (noise.sum.rows > 0) gradient += noise.weight() * noise.sum.gradient;
  for (const PriorGroup& prior : priors)
    for (std::size_t k = 0; k < prior.places.size(); ++k)
      gradient[prior.places[k]] += prior.weight() * prior.changes[k];
  const Eigen::MatrixXd C = covariance_of(information(), fit::SolveOptions().rank_tolerance);
  const Eigen::VectorXd d = -C * gradient;
  double most = 0.0;
  const auto update = [&](double& value, double variance, double least) {
    const double before = value;
    value = std::max(least, value * std::sqrt(std::max(variance, 0.0)));
    most = std::max(most, std::abs(std::log(value / before)));
  };
  for (NoiseGroup& noise : noises) {
    if (noise.sum.rows == 0) continue;
    const double weight = noise.weight();
    const double squares =
        weight * (noise.sum.squares + 2 * noise.sum.gradient.dot(d) + d.dot(noise.sum.information * d));
    noise.redundancy = noise.sum.rows - weight * (noise.sum.information.cwiseProduct(C)).sum();
    if (noise.given > 0 || noise.redundancy < 1e-6) continue;
    const double before = *noise.sigma;
    update(*noise.sigma, squares / noise.redundancy, noise.least);
    noise.scale *= *noise.sigma / before;
  }
  for (PriorGroup& prior : priors) {
    double squares = 0.0;
    const double weight = prior.weight();
    prior.redundancy = 0.0;
    for (std::size_t k = 0; k < prior.places.size(); ++k) {
      const double change = prior.changes[k] + d[prior.places[k]];
      squares += weight * change * change;
      prior.redundancy += 1 - weight * C(prior.places[k], prior.places[k]);
    }
    if (!(prior.given > 0) && prior.redundancy >= 1e-6) update(*prior.sigma, squares / prior.redundancy, prior.least);
  }
  return most;
}

/// The calibration while it goes on, in the stages of the pipeline.
struct ArmCalibration {
  using Place = Placement;

  const Input& input;
  std::vector<double> weights;
  Sigmas sigmas = {};
  Sigmas nominal_sigmas = {};  ///< Of the nominal arm, placed as well as it allows.
  Placement start = {};
  std::optional<ArmProblem> problem = {};
  fit::Solution result = {};
  int iterations = 0;
  double dof = 1.0;                     ///< Behind the estimated noise.
  double min_dof = 0.0;                 ///< Of the kinds of noise, the one known worst.
  Eigen::VectorXd coordinate_dof = {};  ///< Behind the variance of each coordinate.

  std::vector<Placement> starts() const { return arm_problem::starts(input); }
  fit::pipeline::Minimum<Placement> descend(const Placement& from) const { return arm_problem::descend(input, from); }
  void begin(const Placement& from);
  std::size_t fewest() const {
    return static_cast<std::size_t>(std::ceil(sound_postures * static_cast<double>(weights.size())));
  }
  double false_alarm() const { return input.options.outlier_false_alarm; }
  Placement place() const { return problem->placement(); }
  fit::pipeline::Minimum<Placement> revisit(const Placement& from) const;
  bool same(const Placement& one, const Placement& other) const;

  void fit(double loss = 0.0) {
    ArmProblem next(input, sigmas, start, true);
    if (problem) next.begin_at(*problem);
    next.set_weights(weights);
    problem.emplace(std::move(next));
    const bool rough = loss > 0;
    result = problem->fit.solve({.max_iterations = input.options.max_iterations,
                                 .loss = loss,
                                 .cost_tolerance = rough ? 1e-6 : 1e-14,
                                 .uncertainty = !rough});
    iterations += result.fit.iterations;
  }
  VarianceModel variance_model();
  bool update_sigmas();
  void find_noise() {
    for (int round = 0; round < most_refits; ++round) {
      fit();
      if (!update_sigmas()) break;
    }
  }
  double probability(std::size_t i) const;
  std::vector<double> probabilities() const {
    std::vector<double> out;
    for (std::size_t i = 0; i < weights.size(); ++i) out.push_back(probability(i));
    return out;
  }
};

VarianceModel ArmCalibration::variance_model() {
  const KinematicsOptions& options = input.options;
  std::vector<fit::FitMeasurement> poses, pixels;
  for (const auto& mine : problem->observations) poses.insert(poses.end(), mine.begin(), mine.end());
  for (const auto& mine : problem->views) pixels.insert(pixels.end(), mine.begin(), mine.end());
  constexpr int all = std::numeric_limits<int>::max();
  const fit::Problem& fit = problem->fit;
  VarianceModel out;
  out.noises = {{&sigmas.position, options.sigma_position, 1e-9, result.squared_residuals(fit, poses, 0, 3)},
                {&sigmas.rotation, options.sigma_rotation, 1e-9, result.squared_residuals(fit, poses, 3, all)},
                {&sigmas.pixel, options.sigma_pixel, 1e-6, result.squared_residuals(fit, pixels, 0, all)}};
  const fit::SquaredResiduals known = result.squared_residuals(fit, problem->distances, 0, all);
  out.fixed = known.information, out.fixed_gradient = known.gradient;
  PriorGroup length, angle, joint, compliance;
  length.sigma = &sigmas.length, length.given = options.tolerance_length;
  angle.sigma = &sigmas.angle, angle.given = options.tolerance_angle;
  joint.sigma = &sigmas.joint;
  compliance.sigma = &sigmas.compliance, compliance.least = 1e-10;
  const auto put = [](PriorGroup& group, int place, double change) {
    if (place >= 0) group.places.push_back(place), group.changes.push_back(change);
  };
  const std::vector<int> places = result.places(problem->arm);
  const Eigen::VectorXd change = fit.change(problem->arm);
  for (std::size_t k = 0; k < places.size(); ++k)
    put(k % 5 == 0 || k % 5 == 2 ? length : angle, places[k], change[static_cast<Eigen::Index>(k)]);
  if (problem->joint_terms.exists()) {
    const std::vector<int> terms = result.places(problem->joint_terms);
    const Eigen::VectorXd values = fit.change(problem->joint_terms);
    const std::size_t first_compliance = terms.size() - (options.elasticity ? input.nominal.joints.size() : 0);
    for (std::size_t k = 0; k < terms.size(); ++k)
      put(k < first_compliance ? joint : compliance, terms[k], values[static_cast<Eigen::Index>(k)]);
  }
  out.priors = {length, angle, joint, compliance};
  if (problem->tool.exists() && options.T_flange_tool && options.tolerance_tool > 0) {
    const double weight = 1 / (options.tolerance_tool * options.tolerance_tool);
    const std::vector<int> tool = result.places(problem->tool);
    for (std::size_t k = 0; k < 3; ++k)
      if (tool[k] >= 0) {
        out.fixed(tool[k], tool[k]) += weight;
        out.fixed_gradient[tool[k]] += weight * fit.change(problem->tool)[static_cast<Eigen::Index>(k)];
      }
  }
  return out;
}

/// Estimates the standard deviations near the present fit; whether one changed so much that another fit is needed.
bool ArmCalibration::update_sigmas() {
  const Sigmas before = sigmas;
  VarianceModel model = variance_model();
  for (int round = 0; round < variance_rounds && model.step() > variances_settled; ++round) {
  }
  double estimated = 0.0;
  bool known = true;
  min_dof = uncertainty::known_noise;
  for (const NoiseGroup& noise : model.noises) {
    if (noise.sum.rows == 0 || noise.given > 0) continue;
    estimated += noise.redundancy;
    min_dof = std::min(min_dof, noise.redundancy);
    known = false;
  }
  coordinate_dof = model.degrees_of_freedom();
  dof = known ? uncertainty::known_noise : std::max(1.0, estimated);
  const auto moved = [](double now, double then) { return std::abs(std::log(now / then)) > refit_from; };
  return moved(sigmas.position, before.position) || moved(sigmas.rotation, before.rotation) ||
         moved(sigmas.pixel, before.pixel) || moved(sigmas.length, before.length) ||
         moved(sigmas.angle, before.angle) || moved(sigmas.joint, before.joint) ||
         moved(sigmas.compliance, before.compliance);
}

/// Probability that a sound posture lies as far from what the others say.
double ArmCalibration::probability(std::size_t i) const {
  const fit::Agreement agreement = result.agreement(problem->fit, problem->of_posture(i));
  return fit::pipeline::sound_probability(agreement.squared_distance, agreement.dof, weights[i] > 0, dof);
}

/// What the robust fit found far off is put out; the tests that follow decide.
void exclude_far(ArmCalibration& calibration) {
  const std::size_t n = calibration.weights.size();
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < n; ++i) {
    double squared = 0.0, rows = 0.0;
    for (const fit::FitMeasurement o : calibration.problem->of_posture(i)) {
      const Eigen::VectorXd r = calibration.problem->fit.residuals(o);
      squared += r.squaredNorm(), rows += static_cast<double>(r.size());
    }
    order.emplace_back(squared / rows, i);
  }
  std::sort(order.begin(), order.end());
  const double scale = std::max(order[n / 2].first, 1e-12);
  const auto least = static_cast<std::size_t>(std::ceil(sound_postures * static_cast<double>(n)));
  for (std::size_t k = least; k < n; ++k)
    if (order[k].first > 9 * scale) calibration.weights[order[k].second] = 0.0;  // beyond about four sigma
}

void ArmCalibration::begin(const Placement& from) {
  const KinematicsOptions& options = input.options;
  problem.reset();
  weights.assign(weights.size(), 1.0);
  sigmas = {};
  start = place_at(input, from, sigmas);
  nominal_sigmas = sigmas;
  if (options.tolerance_length > 0) sigmas.length = options.tolerance_length;
  if (options.tolerance_angle > 0) sigmas.angle = options.tolerance_angle;
  for (int round = 0; round < 3; ++round) {  // a robust fit, whose scale shrinks with what it explains
    fit(2.0);
    robust_sigmas(*problem, sigmas);
  }
  if (options.sigma_position > 0) sigmas.position = options.sigma_position;
  if (options.sigma_rotation > 0) sigmas.rotation = options.sigma_rotation;
  if (options.sigma_pixel > 0) sigmas.pixel = options.sigma_pixel;
  exclude_far(*this);
}

/// All postures, robust, with the noise that was found.
fit::pipeline::Minimum<Placement> ArmCalibration::revisit(const Placement& from) const {
  ArmProblem descent(input, sigmas, from, true);
  const fit::Solution solved = descent.fit.solve(
      {.max_iterations = input.options.max_iterations, .loss = 2.0, .cost_tolerance = 1e-6, .uncertainty = false});
  return {descent.placement(), solved.cost};
}

/// Whether base and points stand about where they do in another placement: others are metres or half turns away.
bool ArmCalibration::same(const Placement& one, const Placement& other) const {
  const double near = std::max(0.01, 20 * sigmas.position);
  const Vector6 d = pose_difference(one.T_world_base, other.T_world_base);
  return d.head<3>().norm() < near && d.tail<3>().norm() < 0.05 &&
         (one.points.cols() == 0 || (one.points - other.points).colwise().norm().maxCoeff() < near);
}

double rms_distance(const ArmProblem& problem, std::size_t i, double sigma) {
  double squares = 0.0;
  for (const fit::FitMeasurement o : problem.observations[i])
    squares += problem.fit.residuals(o).head<3>().squaredNorm() * sigma * sigma;
  return std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, problem.observations[i].size())));
}

double rms_pixel(const ArmProblem& problem, std::size_t i, double sigma) {
  double squares = 0.0, pixels = 0.0;
  for (const fit::FitMeasurement o : problem.views[i]) {
    const Eigen::VectorXd r = problem.fit.residuals(o);
    squares += r.squaredNorm() * sigma * sigma, pixels += static_cast<double>(r.size()) / 2;
  }
  return std::sqrt(squares / std::max(pixels, 1.0));
}

void write_parameters(const ArmCalibration& calibration, KinematicsResult& out) {
  const ArmProblem& problem = *calibration.problem;
  const fit::FitBlock nominal[] = {problem.arm, problem.joint_terms};
  std::vector<fit::FitBlock> others = {problem.base, problem.tool, problem.camera, problem.target};
  others.insert(others.end(), problem.points.begin(), problem.points.end());
  others.insert(others.end(), problem.sockets.begin(), problem.sockets.end());
  const Eigen::VectorXd inflation =
      calibration.coordinate_dof.unaryExpr([](double dof) { return uncertainty::covariance_inflation(1, dof); });
  parameters::ParameterReport report =
      parameters::report_parameters(problem.fit, calibration.result, nominal, others, inflation);
  out.coordinates = std::move(report.parameters);
  out.covariance = std::move(report.covariance);
}

/// Why the measurements do not tell the arm and its uncertainty; empty when they do.
std::string why_open(const ArmCalibration& calibration) {
  const fit::Solution& result = calibration.result;
  if (calibration.min_dof < min_noise_dof)
    return "the measurements do not separate their noise from errors of the arm (" + std::to_string(result.residuals) +
           " numbers for " + std::to_string(result.coordinates.size()) +
           " parameters); measure more postures, or state the noise, as sigma_position";
  const std::vector<std::string>& open = result.undetermined;
  if (open.empty()) return "";
  std::string text = "neither the measurements nor the nominal arm determine ";
  for (std::size_t k = 0; k < std::min<std::size_t>(open.size(), 3); ++k) text += (k ? ", " : "") + open[k];
  if (open.size() > 3) text += " and " + std::to_string(open.size() - 3) + " more";
  return text + "; move every joint, over wide ranges";
}

void write_postures(const ArmCalibration& calibration, const ArmProblem& nominal, double nominal_sigma,
                    KinematicsResult& out) {
  const Input& input = calibration.input;
  for (std::size_t i = 0; i < input.postures.size(); ++i) {
    ArmPostureReport report;
    report.name = input.postures[i].name.empty() ? std::to_string(i) : input.postures[i].name;
    report.position_error = rms_distance(*calibration.problem, i, calibration.sigmas.position);
    report.nominal_error = rms_distance(nominal, i, nominal_sigma);
    if (input.postures[i].T_world_tool)
      report.rotation_error =
          calibration.sigmas.rotation *
          calibration.problem->fit.residuals(calibration.problem->observations[i].front()).tail<3>().norm();
    report.pixel_error = rms_pixel(*calibration.problem, i, calibration.sigmas.pixel);
    report.probability = calibration.probability(i);
    report.outlier = calibration.weights[i] == 0;
    out.postures.push_back(report);
  }
}

void write_joint_terms(const ArmCalibration& calibration, KinematicsResult& out) {
  const ArmProblem& problem = *calibration.problem;
  if (!problem.joint_terms.exists()) return;
  const KinematicsOptions& options = calibration.input.options;
  const auto& joints = calibration.input.nominal.joints;
  const auto n = static_cast<Eigen::Index>(joints.size());
  const Eigen::VectorXd c = problem.fit.values(problem.joint_terms);
  if (options.joint_errors) {
    out.joint_errors = Eigen::MatrixXd::Zero(n, 4);
    for (Eigen::Index i = 0, k = 0; i < n; ++i)
      if (joints[static_cast<std::size_t>(i)].type == kinematics::JointType::Revolute)
        out.joint_errors.row(i) = c.segment<4>(k).transpose(), k += 4;
    out.tolerance_joint = calibration.sigmas.joint;
  }
  if (!options.elasticity) return;
  out.compliances = c.tail(n);
  out.tolerance_compliance = calibration.sigmas.compliance;
}

}  // namespace

void KinematicsOptions::validate() const {
  require(sigma_position >= 0, "sigma_position must not be negative [m]; 0 means estimated");
  require(sigma_rotation >= 0, "sigma_rotation must not be negative [rad]; 0 means estimated");
  require(sigma_pixel >= 0, "sigma_pixel must not be negative [px]; 0 means estimated");
  require(tolerance_tool >= 0 && (tolerance_tool == 0 || T_flange_tool),
          "tolerance_tool must not be negative [m], and needs T_flange_tool");
  require(tolerance_length >= 0, "tolerance_length must not be negative [m]; 0 means estimated");
  require(tolerance_angle >= 0, "tolerance_angle must not be negative [rad]; 0 means estimated");
  require(outlier_false_alarm >= 0 && outlier_false_alarm < 1, "outlier_false_alarm must lie in [0, 1) [-]");
  require(max_iterations >= 1, "max_iterations must be at least 1");
  for (const auto& T : {T_world_base, T_flange_tool, T_flange_camera, T_base_target})
    require(!T || (T->matrix().allFinite() && is_rotation(T->linear(), 1e-3)),
            "T_world_base, T_flange_tool, T_flange_camera and T_base_target must have a proper rotation");
  if (camera) camera->validate();
}

Eigen::VectorXd KinematicsResult::corrected(const Eigen::VectorXd& q, const Eigen::VectorXd& torques) const {
  Eigen::VectorXd out = q;
  if (joint_errors.size() > 0) {
    require(q.size() == joint_errors.rows(), "q has " + std::to_string(q.size()) + " values, the arm " +
                                                 std::to_string(joint_errors.rows()) + " joints");
    for (Eigen::Index i = 0; i < q.size(); ++i) out[i] += joint_errors.row(i).dot(joint_error_basis(q[i]));
  }
  if (compliances.size() == 0) return out;
  require(torques.size() == compliances.size() && q.size() == compliances.size(),
          "torques: found " + std::to_string(torques.size()) +
              ", expected one a joint: " + std::to_string(compliances.size()));
  return out - compliances.cwiseProduct(torques);
}

Pose KinematicsResult::flange(const Eigen::VectorXd& q, const Eigen::VectorXd& torques) const {
  return arm.flange(corrected(q, torques));
}

KinematicsResult calibrate_kinematics(const kinematics::DhChain& nominal, std::span<const ArmPosture> postures,
                                      std::span<const SocketDistance> distances, const KinematicsOptions& options) {
  const Input input = checked_input(nominal, postures, distances, options);
  ArmCalibration calibration{input, std::vector<double>(postures.size(), 1.0)};
  const auto rival = fit::pipeline::run(calibration);
  const ArmProblem as_nominal(input, calibration.nominal_sigmas, calibration.start, false);

  KinematicsResult out;
  const ArmProblem& problem = *calibration.problem;
  out.arm = problem.fit.arm(problem.arm);
  const Placement placement = problem.placement();
  out.T_world_base = placement.T_world_base;
  out.T_flange_tool = placement.T_flange_tool;
  out.T_flange_camera = placement.T_flange_camera;
  out.T_base_target = placement.T_base_target;
  out.points = placement.points;
  out.sockets = placement.sockets;
  out.socket_names = input.socket_names;
  write_joint_terms(calibration, out);
  out.unidentifiable = calibration.result.unidentifiable;
  out.sigma_position = calibration.sigmas.position;
  out.sigma_rotation = calibration.sigmas.rotation;
  out.sigma_pixel = calibration.sigmas.pixel;
  out.tolerance_length = calibration.sigmas.length;
  out.tolerance_angle = calibration.sigmas.angle;
  out.dof = calibration.dof;
  write_parameters(calibration, out);
  write_postures(calibration, as_nominal, calibration.nominal_sigmas.position, out);
  out.fit = calibration.result.fit;
  out.fit.iterations = calibration.iterations;
  if (const std::string open = why_open(calibration); !open.empty()) {
    out.fit.status = FitStatus::Degenerate;
    out.fit.message = open;
  }
  if (rival)
    out.second = fit::pipeline::second_minimum(out.T_world_base, rival->at.T_world_base, rival->best_cost, rival->cost,
                                               calibration.dof);
  fit::pipeline::refuse_undecided(out.second, "two places of the arm explain the measurements",
                                  "measure more postures, or state where the base is", out.fit);
  return out;
}

}  // namespace kr5::calibration
