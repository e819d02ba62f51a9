// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/kinematics.hpp>

#include <algorithm>
#include <cmath>
#include <set>

#include <kr5/core/error.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "calibration/cell_fit/parameter_report.hpp"
#include "calibration/cell_fit/sound_probability.hpp"
#include "calibration/cell_fit/variance_component.hpp"
#include "calibration/kinematics/arm_problem.hpp"

namespace kr5::calibration {
namespace {

using namespace arm_problem;

constexpr double sound_postures = 0.6;  // at least this part of the postures stays in the fit
constexpr int variance_rounds = 40;

void check_posture(const ArmPosture& posture, std::size_t row, Eigen::Index joints) {
  const std::string where = "posture " + (posture.name.empty() ? std::to_string(row) : posture.name) + ": ";
  require(posture.q.size() == joints, where + "found " + std::to_string(posture.q.size()) +
                                          " joint values, the arm has " + std::to_string(joints) + " joints");
  require(posture.q.allFinite(), where + "joint values must be finite");
  const bool any_seen = posture.points.cols() > 0 && posture.points.array().isFinite().any();
  require(posture.T_world_tool || any_seen || !posture.socket.empty(), where + "nothing was measured of it");
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
    check_posture(postures[i], i, static_cast<Eigen::Index>(nominal.joints.size()));
    if (!postures[i].socket.empty()) sockets.insert(postures[i].socket);
  }
  Input input{nominal, postures, distances, options, {sockets.begin(), sockets.end()}};
  for (const SocketDistance& d : distances) {
    require(d.distance > 0 && d.sigma > 0, "a distance of sockets and its sigma must be positive [m]");
    input.socket(d.first), input.socket(d.second);
  }
  return input;
}

/// What one fit says of the standard deviations it assumed: each component over that assumed is 1 when it was right.
struct Components {
  cell_fit::VarianceComponent position, rotation, length, angle, joint;
};

/// The calibration while it goes on.
struct Calibration {
  const Input& input;
  Sigmas sigmas;
  Placement start;
  std::vector<double> weights;
  std::optional<ArmProblem> problem;
  CellFitResult result;
  int iterations = 0;

  void fit(double loss = 0.0) {
    ArmProblem next(input, sigmas, start, true);
    if (problem) next.begin_at(*problem);
    next.set_weights(weights);
    problem.emplace(std::move(next));
    result = problem->fit.solve({.max_iterations = input.options.max_iterations, .loss = loss});
    iterations += result.fit.iterations;
  }
  Components components() const;
  bool update_sigmas();
  void find_sigmas() {
    for (int round = 0; round < variance_rounds; ++round) {
      fit();
      if (!update_sigmas()) break;
    }
  }
  double dof() const {
    const Components c = components();
    return std::max(1.0, c.position.redundancy + c.rotation.redundancy);
  }
  double probability(std::size_t i, double degrees) const;
  void name_outliers();
};

Components Calibration::components() const {
  Components out;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (!(weights[i] > 0)) continue;
    for (const FitObservation o : problem->observations[i]) {
      const CellFit::Agreement agreement = problem->fit.agreement(o);
      for (Eigen::Index k = 0; k < agreement.residuals.size(); ++k)
        (k < 3 ? out.position : out.rotation).add(agreement.residuals[k], agreement.redundancy[k]);
    }
  }
  const Eigen::VectorXd arm = problem->fit.change(problem->arm), share = problem->fit.prior_redundancy(problem->arm);
  for (Eigen::Index k = 0; k < arm.size(); ++k) {
    const bool length = k % 5 == 0 || k % 5 == 2;
    // A prior's redundancy is the share that the data leave to it; what they determine is what tells its spread.
    (length ? out.length : out.angle).add(arm[k] / (length ? sigmas.length : sigmas.angle), share[k]);
  }
  if (!problem->joint_terms.exists()) return out;
  const Eigen::VectorXd terms = problem->fit.change(problem->joint_terms),
                        left = problem->fit.prior_redundancy(problem->joint_terms);
  for (Eigen::Index k = 0; k < terms.size(); ++k) out.joint.add(terms[k] / sigmas.joint, left[k]);
  return out;
}

/// Restricted maximum likelihood by Förstner's iteration; whether it goes on.
bool Calibration::update_sigmas() {
  const Components c = components();
  const KinematicsOptions& options = input.options;
  bool moving = false;
  const auto step = [&](double& sigma, const cell_fit::VarianceComponent& component, double given, double least) {
    if (!(given > 0)) moving = component.update(sigma, least) || moving;
  };
  step(sigmas.position, c.position, options.sigma_position, 1e-9);
  step(sigmas.rotation, c.rotation, options.sigma_rotation, 1e-9);
  step(sigmas.length, c.length, options.tolerance_length, 1e-6);
  step(sigmas.angle, c.angle, options.tolerance_angle, 1e-6);
  step(sigmas.joint, c.joint, 0.0, 1e-6);
  return moving;
}

/// Probability that a sound posture lies as far from what the others say; `degrees` of freedom stand behind the noise.
double Calibration::probability(std::size_t i, double degrees) const {
  const CellFit::Agreement agreement = problem->fit.agreement(problem->observations[i]);
  return cell_fit::sound_probability(agreement.squared_distance, agreement.dof, weights[i] > 0,
                                     input.options.sigma_position > 0 ? uncertainty::known_noise : degrees);
}

void Calibration::name_outliers() {
  const auto probabilities = [&] {
    const double degrees = dof();
    std::vector<double> out;
    for (std::size_t i = 0; i < weights.size(); ++i) out.push_back(probability(i, degrees));
    return out;
  };
  cell_fit::settle_outliers(weights, input.options.outlier_false_alarm, sound_postures, probabilities,
                            [&] { find_sigmas(); });
}

/// What the robust fit found far off is put out; the tests that follow decide.
void exclude_far(Calibration& calibration) {
  const std::size_t n = calibration.weights.size();
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < n; ++i) {
    double squared = 0.0, rows = 0.0;
    for (const FitObservation o : calibration.problem->observations[i]) {
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

double rms_distance(const ArmProblem& problem, std::size_t i, double sigma) {
  double squares = 0.0;
  for (const FitObservation o : problem.observations[i])
    squares += problem.fit.residuals(o).head<3>().squaredNorm() * sigma * sigma;
  return std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, problem.observations[i].size())));
}

void write_parameters(const Calibration& calibration, KinematicsResult& out) {
  const ArmProblem& problem = *calibration.problem;
  const FitBlock nominal[] = {problem.arm, problem.joint_terms};
  std::vector<FitBlock> others = {problem.base, problem.tool};
  others.insert(others.end(), problem.points.begin(), problem.points.end());
  others.insert(others.end(), problem.sockets.begin(), problem.sockets.end());
  cell_fit::ParameterReport report = cell_fit::report_parameters(problem.fit, calibration.result, nominal, others,
                                                                 uncertainty::covariance_inflation(1, out.dof));
  out.coordinates = std::move(report.parameters);
  out.covariance = std::move(report.covariance);
}

void write_postures(const Calibration& calibration, const ArmProblem& nominal, double nominal_sigma,
                    KinematicsResult& out) {
  const Input& input = calibration.input;
  const double degrees = calibration.dof();
  for (std::size_t i = 0; i < input.postures.size(); ++i) {
    ArmPostureReport report;
    report.name = input.postures[i].name.empty() ? std::to_string(i) : input.postures[i].name;
    report.position_error = rms_distance(*calibration.problem, i, calibration.sigmas.position);
    report.nominal_error = rms_distance(nominal, i, nominal_sigma);
    if (input.postures[i].T_world_tool)
      report.rotation_error =
          calibration.sigmas.rotation *
          calibration.problem->fit.residuals(calibration.problem->observations[i].front()).tail<3>().norm();
    report.probability = calibration.probability(i, degrees);
    report.outlier = calibration.weights[i] == 0;
    out.postures.push_back(report);
  }
}

}  // namespace

void KinematicsOptions::validate() const {
  require(sigma_position >= 0, "sigma_position must not be negative [m]; 0 means estimated");
  require(sigma_rotation >= 0, "sigma_rotation must not be negative [rad]; 0 means estimated");
  require(tolerance_length >= 0, "tolerance_length must not be negative [m]; 0 means estimated");
  require(tolerance_angle >= 0, "tolerance_angle must not be negative [rad]; 0 means estimated");
  require(outlier_false_alarm >= 0 && outlier_false_alarm < 1, "outlier_false_alarm must lie in [0, 1) [-]");
  require(max_iterations >= 1, "max_iterations must be at least 1");
  for (const auto& T : {T_world_base, T_flange_tool})
    require(!T || (T->matrix().allFinite() && is_rotation(T->linear(), 1e-3)),
            "T_world_base and T_flange_tool must have a proper rotation");
}

Eigen::VectorXd KinematicsResult::corrected(const Eigen::VectorXd& q) const {
  if (joint_errors.size() == 0) return q;
  require(q.size() == joint_errors.rows(),
          "q has " + std::to_string(q.size()) + " values, the arm " + std::to_string(joint_errors.rows()) + " joints");
  Eigen::VectorXd out = q;
  for (Eigen::Index i = 0; i < q.size(); ++i) out[i] += joint_errors.row(i).dot(joint_error_basis(q[i]));
  return out;
}

Pose KinematicsResult::flange(const Eigen::VectorXd& q) const { return arm.flange(corrected(q)); }

KinematicsResult calibrate_kinematics(const kinematics::DhChain& nominal, std::span<const ArmPosture> postures,
                                      std::span<const SocketDistance> distances, const KinematicsOptions& options) {
  const Input input = checked_input(nominal, postures, distances, options);
  Calibration calibration{input, {}, {}, std::vector<double>(postures.size(), 1.0), {}, {}, 0};
  calibration.start = place(input, calibration.sigmas);
  const Sigmas nominal_sigmas = calibration.sigmas;
  const ArmProblem as_nominal(input, nominal_sigmas, calibration.start, false);
  if (options.tolerance_length > 0) calibration.sigmas.length = options.tolerance_length;
  if (options.tolerance_angle > 0) calibration.sigmas.angle = options.tolerance_angle;
  for (int round = 0; round < 3; ++round) {  // a robust fit, whose scale shrinks with what it explains
    calibration.fit(2.0);
    robust_sigmas(*calibration.problem, calibration.sigmas);
  }
  if (options.sigma_position > 0) calibration.sigmas.position = options.sigma_position;
  if (options.sigma_rotation > 0) calibration.sigmas.rotation = options.sigma_rotation;
  exclude_far(calibration);
  calibration.find_sigmas();
  calibration.name_outliers();

  KinematicsResult out;
  const ArmProblem& problem = *calibration.problem;
  out.arm = problem.fit.arm(problem.arm);
  const Placement placement = problem.placement();
  out.T_world_base = placement.T_world_base;
  out.T_flange_tool = placement.T_flange_tool;
  out.points = placement.points;
  out.sockets = placement.sockets;
  out.socket_names = input.socket_names;
  if (problem.joint_terms.exists()) {
    const Eigen::VectorXd c = problem.fit.values(problem.joint_terms);
    out.joint_errors = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(nominal.joints.size()), 4);
    for (Eigen::Index i = 0, k = 0; i < out.joint_errors.rows(); ++i)
      if (nominal.joints[static_cast<std::size_t>(i)].type == kinematics::JointType::Revolute)
        out.joint_errors.row(i) = c.segment<4>(k).transpose(), k += 4;
  }
  out.unidentifiable = calibration.result.unidentifiable;
  out.sigma_position = calibration.sigmas.position;
  out.sigma_rotation = calibration.sigmas.rotation;
  out.tolerance_length = calibration.sigmas.length;
  out.tolerance_angle = calibration.sigmas.angle;
  out.tolerance_joint = problem.joint_terms.exists() ? calibration.sigmas.joint : 0.0;
  out.dof = options.sigma_position > 0 ? uncertainty::known_noise : calibration.dof();
  write_parameters(calibration, out);
  write_postures(calibration, as_nominal, nominal_sigmas.position, out);
  out.fit = calibration.result.fit;
  out.fit.iterations = calibration.iterations;
  return out;
}

}  // namespace kr5::calibration
