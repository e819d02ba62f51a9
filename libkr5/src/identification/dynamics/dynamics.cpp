// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/dynamics.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <kr5/core/error.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "identification/dynamics/column_algebra.hpp"
#include "identification/dynamics/consistent_bodies.hpp"
#include "identification/dynamics/estimate_choice.hpp"
#include "identification/dynamics/joint_fit.hpp"
#include "identification/dynamics/term_choice.hpp"

namespace kr5::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Rows of the base parameters for one part of a motion.
JointRows base_rows(const DynamicsRegressor& regressor, const BaseParameters& base, const JointMotion& motion,
                    const MatrixXd& load, double min_speed) {
  JointRows out{
      regressor.joint_regressors(motion, base.independent, load), base.independent, motion.tau, motion.run_starts, {}};
  leave_out_rest(motion, regressor.model().structure, min_speed, out);
  return out;
}

bool needs_load(const DynamicsModel& model) {
  return std::any_of(model.terms.begin(), model.terms.end(), [](const JointTerms& t) { return t.load; });
}

std::string joined(const std::vector<std::string>& words, std::size_t most = 6) {
  std::string out;
  for (std::size_t k = 0; k < std::min(words.size(), most); ++k) out += (k ? ", " : "") + words[k];
  return words.size() > most ? out + " and " + std::to_string(words.size() - most) + " more" : out;
}

/// A solid ball about the origin of each link, when nothing is known of it.
std::vector<kinematics::Body> default_priors(int joints) {
  const double mass = 2.0, radius = 0.2, inertia = 0.4 * mass * radius * radius;
  kinematics::Body ball;
  ball.mass = mass;
  ball.inertia << inertia, inertia, inertia, 0, 0, 0;
  return std::vector<kinematics::Body>(static_cast<std::size_t>(joints), ball);
}

/// The linear estimate, and the torques of the links by it that load-dependent friction asks for.
struct LinearEstimate {
  JointFit fit;
  MatrixXd load;
};

LinearEstimate estimate_linear(const DynamicsRegressor& regressor, const BaseParameters& base,
                               const JointMotion& motion, const DynamicsOptions& options,
                               const JointMotion* instruments) {
  const JointFitOptions fit_options{
      options.estimator == Estimator::Consistent ? Estimator::Weighted : options.estimator, options.huber,
      options.max_iterations, 1e-7};
  LinearEstimate out;
  const bool loaded = needs_load(regressor.model());
  if (loaded) out.load = MatrixXd::Zero(motion.samples(), motion.joints());  // at first without that friction
  for (int turn = 0; turn < (loaded ? 3 : 1); ++turn) {
    const JointRows rows = base_rows(regressor, base, motion, out.load, options.min_speed);
    std::vector<JointRegressor> others;
    if (instruments) others = regressor.joint_regressors(*instruments, base.independent, out.load);
    out.fit = fit_joint_rows(rows, fit_options, instruments ? &others : nullptr);
    if (loaded) out.load = regressor.link_torques(motion, base.standard(out.fit.beta));
  }
  return out;
}

/// Samples that count as one, over all joints: with it they hold as many independent ones as with their own.
double common_correlation(const JointRows& rows, const VectorXd& correlation) {
  double used = 0.0, independent = 0.0;
  for (Index i = 0; i < correlation.size(); ++i) {
    used += rows.used_rows(i);
    independent += rows.used_rows(i) / correlation[i];
  }
  return used / std::max(independent, 1.0);
}

/// Replaces the linear estimate by one whose bodies can exist.
void make_consistent(const DynamicsRegressor& regressor, const JointMotion& motion, const LinearEstimate& linear,
                     const DynamicsOptions& options, DynamicsResult& result) {
  std::vector<int> all(static_cast<std::size_t>(regressor.parameters()));
  for (std::size_t c = 0; c < all.size(); ++c) all[c] = static_cast<int>(c);
  JointRows rows{regressor.joint_regressors(motion, {}, linear.load), all, motion.tau, motion.run_starts, {}};
  leave_out_rest(motion, regressor.model().structure, options.min_speed, rows);
  std::vector<MatrixXd> factors;
  for (std::size_t i = 0; i < rows.regressors.size(); ++i) {
    const MatrixXd& X = rows.regressors[i].X;
    MatrixXd both(X.rows(), X.cols() + 1);
    both << X, rows.tau.col(static_cast<Index>(i));
    factors.push_back(triangular_factor(both));
  }
  // Exact torques, which simulations give, must not drown the prior in rounding.
  const double least = 1e-6 * motion.tau.norm() / std::sqrt(static_cast<double>(motion.tau.size()));
  // Samples that are correlated count as fewer beside the prior. All joints alike: a joint whose correlation is that of
  // errors of the model would otherwise lose its say over what it tells better than the others.
  const VectorXd weights =
      linear.fit.sigma.cwiseMax(least).cwiseInverse() / std::sqrt(common_correlation(rows, linear.fit.correlation));
  const Index p = regressor.parameters();
  const MatrixXd R = stacked_factor(factors, column_positions(rows.regressors, all), p + 1, weights);
  const bool known = !options.prior_bodies.empty();
  const ConsistentFit fit =
      fit_consistent(R.topLeftCorner(p, p), R.col(p).head(p), regressor.joints(),
                     known ? options.prior_bodies : default_priors(regressor.joints()),
                     known ? options.prior_spread : std::max(options.prior_spread, 2.0), options.max_body_iterations);
  result.fit.iterations += fit.iterations;
  if (!fit.converged) {
    result.fit.status = FitStatus::MaxIterations;
    result.fit.message = "the bodies had not converged after " + std::to_string(fit.iterations) +
                         " steps; values are those of the last one";
  }
  result.parameters = fit.parameters;
  result.values = result.base.values(fit.parameters);
  if (fit.covariance.size() > 0) {
    // Noise as correlated as found in place of rows without correlation; the rest is the prior's.
    const MatrixXd alone = R.leftCols(p),
                   excess = score_covariance(rows, linear.fit, weights) - alone.transpose() * alone,
                   C = fit.covariance + fit.covariance * excess * fit.covariance;
    result.covariance = result.base.regrouping * C * result.base.regrouping.transpose();
  }
  for (int i = 0; i < regressor.joints(); ++i) {
    const VectorXd chi = fit.parameters.segment<10>(parameters_per_joint * i);
    kinematics::InertialParameters ours;
    ours << chi[9], chi.segment<3>(6), chi.head<6>();
    result.bodies.push_back(kinematics::to_body(kinematics::to_moments(ours)));
  }
}

/// Torques of all samples. Those of a linear fit of every row follow from its residuals.
MatrixXd predicted_torques(const DynamicsRegressor& regressor, const JointMotion& motion, const JointMotion& fitted,
                           const JointFit& fit, const DynamicsOptions& options, const VectorXd& parameters) {
  const bool known =
      options.estimator != Estimator::Consistent && options.min_speed == 0 && !needs_load(regressor.model());
  if (!known) return regressor.torques(motion, parameters);
  const Index first = fitted.samples(), rest = motion.samples() - first;
  MatrixXd out(motion.samples(), motion.joints());
  out.topRows(first) = fitted.tau - fit.residuals;
  if (rest > 0) out.bottomRows(rest) = regressor.torques(part_of(motion, first, rest), parameters);
  return out;
}

void check_instruments(const JointMotion& motion, const DynamicsOptions& options, const JointMotion* instruments) {
  require(options.estimator != Estimator::Instruments || instruments != nullptr,
          "instruments: the estimator needs the same motion as commanded, simulated, or recorded again");
  require(options.estimator == Estimator::Instruments || instruments == nullptr,
          "instruments: only the estimator `instruments` reads them");
  if (!instruments) return;
  instruments->validate();
  require(instruments->samples() == motion.samples() && instruments->joints() == motion.joints(),
          "instruments: expected " + std::to_string(motion.samples()) + " samples of " +
              std::to_string(motion.joints()) + " joints, as the motion has");
}

void check_inputs(const JointMotion& motion, const DynamicsModel& model, const DynamicsOptions& options,
                  const JointMotion* instruments) {
  options.validate();
  motion.validate();
  require(motion.joints() == model.joints(), "motion: expected " + std::to_string(model.joints()) +
                                                 " joints, as the chain has, found " + std::to_string(motion.joints()));
  require(options.prior_bodies.empty() || static_cast<int>(options.prior_bodies.size()) == model.joints(),
          "prior_bodies: expected one a link, " + std::to_string(model.joints()));
  check_instruments(motion, options, instruments);
}

/// The linear estimate, and the friction terms and base parameters of the result that go with it.
LinearEstimate estimate_with_terms(const DynamicsModel& given, const JointMotion& fitted,
                                   const DynamicsOptions& options, const JointMotion* instruments,
                                   DynamicsResult& out) {
  const auto estimate = [&] {
    return estimate_linear(DynamicsRegressor(out.model), out.base, fitted, options, instruments);
  };
  LinearEstimate linear = estimate();
  if (!options.choose_terms) return linear;
  const MatrixXd load = DynamicsRegressor(out.model).link_torques(fitted, out.base.standard(linear.fit.beta));
  out.model.terms = choose_friction_terms(
      out.model, fitted, base_rows(DynamicsRegressor(out.model), out.base, fitted, load, options.min_speed),
      linear.fit.sigma, load, options.blocks, options.min_speed);
  do {
    out.base = base_parameters(out.model);
    linear = estimate();
  } while (take_doubtful_term(given, out.base, linear.fit, out.model.terms));
  return linear;
}

void take_linear(const JointFit& fit, const JointMotion& fitted, DynamicsResult& out) {
  out.observability = observability_from_factor(out.base, fitted, fit.factor);
  out.fit.status = fit.converged ? FitStatus::Converged : FitStatus::MaxIterations;
  out.fit.iterations = fit.iterations;
  out.fit.message = fit.converged ? "converged" : "the weights of the joints had not settled";
  out.values = fit.beta;
  out.covariance = fit.covariance;
  out.parameters = out.base.standard(out.values);
  out.sigma = fit.sigma;
  out.correlation = fit.correlation;
}

void inflate_covariance(double freedom, DynamicsResult& out) {
  out.deviations =
      (uncertainty::covariance_inflation(1, freedom) * out.covariance.diagonal().cwiseMax(0.0)).cwiseSqrt();
  out.covariance *= uncertainty::covariance_inflation(static_cast<double>(out.values.size()), freedom);
}

/// Errors of the predicted torques, of the samples that were fitted and of those held out.
void judge_fit(const JointMotion& motion, const JointMotion& fitted, DynamicsResult& out) {
  const Index count = fitted.samples(), rest = motion.samples() - count;
  out.fitted = torque_error(fitted.tau, out.predicted.topRows(count));
  out.held_out = torque_error(motion.tau.bottomRows(rest), out.predicted.bottomRows(rest));
  const auto whitened = [&](const MatrixXd& off) {
    return (off * out.sigma.cwiseInverse().asDiagonal()).norm() / std::sqrt(static_cast<double>(off.size()));
  };
  out.fit.initial_rms = whitened(fitted.tau);
  out.fit.final_rms = whitened(fitted.tau - out.predicted.topRows(count));
}

void say_unobservable(DynamicsResult& out) {
  if (!out.observability.unmoved.empty()) {
    std::string joints;
    for (const int i : out.observability.unmoved) joints += (joints.empty() ? "" : ", ") + std::to_string(i);
    out.fit.status = FitStatus::Degenerate;
    out.fit.message =
        "joint " + joints + " never moved; the motion does not determine " + joined(out.observability.unidentifiable);
  } else if (!out.observability.unidentifiable.empty()) {
    out.fit.message += "; the motion does not determine " + joined(out.observability.unidentifiable);
  }
}

}  // namespace

TorqueError torque_error(const MatrixXd& measured, const MatrixXd& predicted) {
  require(measured.rows() == predicted.rows() && measured.cols() == predicted.cols(),
          "predicted: expected " + std::to_string(measured.rows()) + " x " + std::to_string(measured.cols()) +
              " torques, found " + std::to_string(predicted.rows()) + " x " + std::to_string(predicted.cols()));
  TorqueError out;
  if (measured.rows() == 0) return out;
  const MatrixXd off = measured - predicted;
  const VectorXd errors = off.colwise().norm(), sizes = measured.colwise().norm();
  out.rms = errors / std::sqrt(static_cast<double>(measured.rows()));
  out.relative = errors.cwiseQuotient((sizes.array() > 0).select(sizes, 1.0));
  out.total = off.norm() / measured.norm();
  return out;
}

void DynamicsOptions::validate() const {
  require(held_out >= 0 && held_out < 1, "held_out must be at least 0 and below 1 [-]");
  require(blocks >= 3, "blocks must be at least 3");
  require(huber > 0 && std::isfinite(huber), "huber must be positive [standard deviations]");
  require(min_speed >= 0 && min_speed < 1, "min_speed must be at least 0 and below 1 [-]");
  require(max_iterations > 0, "max_iterations must be positive");
  require(max_body_iterations > 0, "max_body_iterations must be positive");
  require(!choose_estimate || estimator == Estimator::Weighted || estimator == Estimator::Consistent,
          "choose_estimate: compares weighted and consistent only; leave estimator at one of these");
  require(prior_spread > 0 && std::isfinite(prior_spread), "prior_spread must be positive [-]");
}

std::optional<std::pair<double, double>> DynamicsResult::parameter(const std::string& name) const {
  for (std::size_t k = 0; k < base.expressions.size(); ++k)
    if (base.expressions[k] == name && static_cast<Index>(k) < values.size())
      return std::pair{values[static_cast<Index>(k)], deviations[static_cast<Index>(k)]};
  return std::nullopt;
}

DynamicsResult identify_dynamics(const JointMotion& motion, const DynamicsModel& model, const DynamicsOptions& given,
                                 const JointMotion* instruments) {
  DynamicsOptions options = given;
  check_inputs(motion, model, options, instruments);
  DynamicsResult out;
  const auto count = static_cast<Index>(std::lround((1.0 - options.held_out) * static_cast<double>(motion.samples())));
  out.first_held_out = static_cast<int>(count);
  out.model = DynamicsRegressor(model).model();
  out.base = base_parameters(out.model);
  if (count * model.joints() <= out.base.size()) {
    out.fit.message = "too few samples: " + std::to_string(count) + " to fit, " + std::to_string(out.base.size()) +
                      " base parameters";
    return out;
  }
  const JointMotion fitted = part_of(motion, 0, count);
  if (options.choose_estimate) options = choose_estimate(fitted, out.model, options);
  out.estimator = options.estimator;
  out.prior_spread = options.prior_spread;
  out.min_speed = options.min_speed;
  std::optional<JointMotion> others;
  if (instruments) others = part_of(*instruments, 0, count);
  const LinearEstimate linear = estimate_with_terms(model, fitted, options, others ? &*others : nullptr, out);
  const DynamicsRegressor regressor(out.model);
  take_linear(linear.fit, fitted, out);
  if (options.estimator == Estimator::Consistent) make_consistent(regressor, fitted, linear, options, out);
  inflate_covariance(linear.fit.freedom, out);
  out.predicted = predicted_torques(regressor, motion, fitted, linear.fit, options, out.parameters);
  judge_fit(motion, fitted, out);
  say_unobservable(out);
  return out;
}

MatrixXd predict_torques(const DynamicsResult& result, const JointMotion& motion) {
  require(result.parameters.size() > 0, "result: holds no estimate: " + result.fit.message);
  return DynamicsRegressor(result.model).torques(motion, result.parameters);
}

}  // namespace kr5::identification
