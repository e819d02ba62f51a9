// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/base_parameters.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/core/random.hpp>

#include "identification/dynamics/column_algebra.hpp"
#include "identification/dynamics/right_angles.hpp"

namespace kr5::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double unmoved_range = 1e-3;  ///< [rad or m]

/// States at random. Speeds are spread over decades, so that terms of low speed show.
JointMotion random_states(const DynamicsModel& model, const BaseParameterOptions& options, Index count) {
  const Index n = model.joints();
  Random random(options.seed);
  double warm = 1.0;
  for (const JointTerms& t : model.terms) warm = std::max(warm, 3 * t.thermal_time_constant);
  JointMotion out{VectorXd::LinSpaced(count, 0.0, warm),
                  MatrixXd(count, n),
                  MatrixXd(count, n),
                  MatrixXd(count, n),
                  MatrixXd::Zero(count, n),
                  {},
                  MatrixXd::Zero(count, n)};
  for (Index k = 0; k < count; ++k)
    for (Index i = 0; i < n; ++i) {
      const bool slides = model.chain.joints[static_cast<std::size_t>(i)].type == kinematics::JointType::Prismatic;
      const double reach = slides ? 1.0 : M_PI;
      out.q(k, i) = random.uniform(options.lower.size() ? options.lower[i] : -reach,
                                   options.upper.size() ? options.upper[i] : reach);
      out.qd(k, i) = (random.integer(2) ? 1 : -1) * std::pow(10.0, random.uniform(-3.0, 0.5));
      out.qdd(k, i) = random.uniform(-5.0, 5.0);
      out.tau(k, i) = random.uniform(-50.0, 50.0);
      out.temperature(k, i) = random.uniform(0.0, 60.0);
    }
  return out;
}

std::string dependence(const ColumnSplit& split, std::size_t d, const BaseParameters& base, const VectorXd& length) {
  const auto name = [&](int c) {
    return base.parameters[static_cast<std::size_t>(base.independent[static_cast<std::size_t>(c)])];
  };
  std::string out = name(split.dependent[d]), beside;
  for (std::size_t k = 0; k < split.independent.size(); ++k) {
    const double share = std::abs(split.coefficients(static_cast<Index>(k), static_cast<Index>(d))) *
                         length[split.independent[k]] / std::max(length[split.dependent[d]], 1e-300);
    if (share > 0.05) beside += (beside.empty() ? "" : ", ") + name(split.independent[k]);
  }
  return beside.empty() ? out : out + " apart from " + beside;
}

}  // namespace

void BaseParameterOptions::validate() const {
  require(samples >= 0, "samples must not be negative; 0 means twice the number of parameters");
  require(tolerance > 0 && tolerance < 1, "tolerance must be between 0 and 1 [-]");
  require(lower.size() == upper.size(), "lower, upper: expected one value a joint each, or none");
  for (Index i = 0; i < lower.size(); ++i)
    require(lower[i] < upper[i], "lower must be below upper, joint " + std::to_string(i + 1) + " [rad or m]");
}

VectorXd BaseParameters::standard(const VectorXd& base) const {
  require(base.size() == size(),
          "base: expected " + std::to_string(size()) + " values, found " + std::to_string(base.size()));
  VectorXd out = VectorXd::Zero(static_cast<Index>(parameters.size()));
  for (int k = 0; k < size(); ++k) out[independent[static_cast<std::size_t>(k)]] = base[k];
  return out;
}

bool BaseParameters::identifiable(const VectorXd& combination, double tolerance) const {
  require(combination.size() == regrouping.cols(), "combination: expected " + std::to_string(regrouping.cols()) +
                                                       " coefficients, found " + std::to_string(combination.size()));
  VectorXd weights(size());
  for (int k = 0; k < size(); ++k) weights[k] = combination[independent[static_cast<std::size_t>(k)]];
  return (regrouping.transpose() * weights - combination).norm() <= tolerance * combination.norm();
}

BaseParameters base_parameters(const DynamicsModel& model, const BaseParameterOptions& options) {
  options.validate();
  DynamicsModel meant = model;
  const ArmInGravity arm = with_right_angles(model.chain, model.gravity);
  meant.chain = arm.chain;
  meant.gravity = arm.gravity;
  const DynamicsRegressor regressor(meant);
  require(options.lower.size() == 0 || options.lower.size() == model.joints(),
          "lower, upper: expected " + std::to_string(model.joints()) + " values, found " +
              std::to_string(options.lower.size()));
  const int p = regressor.parameters();
  const JointMotion states = random_states(model, options, options.samples > 0 ? options.samples : 2 * p);
  const MatrixXd R = triangular_factor(regressor.evaluate(states, states.tau));
  const ColumnSplit split = split_columns(R, preferred_order(model.joints(), p), options.tolerance);
  BaseParameters out{regressor.names(), split.independent, {}, {}, {}};
  out.regrouping = MatrixXd::Zero(out.size(), p);
  for (int k = 0; k < out.size(); ++k) {
    out.regrouping(k, split.independent[static_cast<std::size_t>(k)]) = 1.0;
    for (std::size_t d = 0; d < split.dependent.size(); ++d)
      out.regrouping(k, split.dependent[d]) = split.coefficients(k, static_cast<Index>(d));
    out.expressions.push_back(linear_expression(out.regrouping.row(k), out.parameters));
    out.units.push_back(regressor.units()[static_cast<std::size_t>(split.independent[static_cast<std::size_t>(k)])]);
  }
  return out;
}

MatrixXd observation_factor(const DynamicsModel& model, const BaseParameters& base, const JointMotion& motion) {
  const DynamicsRegressor regressor(model);
  const std::vector<JointRegressor> rows = regressor.joint_regressors(motion, base.independent, motion.tau);
  std::vector<MatrixXd> factors;
  for (const JointRegressor& joint : rows) factors.push_back(triangular_factor(joint.X));
  return stacked_factor(factors, column_positions(rows, base.independent), base.size(), VectorXd::Ones(model.joints()));
}

Observability observability(const DynamicsModel& model, const BaseParameters& base, const JointMotion& motion,
                            double tolerance) {
  motion.validate();
  return observability_from_factor(base, motion, observation_factor(model, base, motion), tolerance);
}

Observability observability_from_factor(const BaseParameters& base, const JointMotion& motion, const MatrixXd& R,
                                        double tolerance) {
  const auto condition = [](const VectorXd& s) {
    return s.size() == 0 || s[s.size() - 1] <= 0 ? std::numeric_limits<double>::infinity() : s[0] / s[s.size() - 1];
  };
  Observability out;
  out.condition = condition(singular_values(R));
  const VectorXd length = R.colwise().norm();
  MatrixXd scaled = R;
  for (Index c = 0; c < R.cols(); ++c)
    if (length[c] > 0) scaled.col(c) /= length[c];
  out.singular_values = singular_values(scaled);
  out.scaled_condition = condition(out.singular_values);
  std::vector<int> order(static_cast<std::size_t>(base.size()));
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = static_cast<int>(k);
  const ColumnSplit split = split_columns(R, order, tolerance);
  for (std::size_t d = 0; d < split.dependent.size(); ++d)
    out.unidentifiable.push_back(dependence(split, d, base, length));
  for (int i = 0; i < motion.joints(); ++i)
    if (motion.q.col(i).maxCoeff() - motion.q.col(i).minCoeff() < unmoved_range) out.unmoved.push_back(i + 1);
  return out;
}

}  // namespace kr5::identification
