// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/payload.hpp>

#include <cmath>

#include <Eigen/Cholesky>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "identification/dynamics/column_algebra.hpp"
#include "identification/dynamics/joint_fit.hpp"

namespace kr5::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int moments_count = kinematics::inertial_parameter_count;

/// From the order of eq. 4.36 to that of kinematics::InertialParameters.
Eigen::Matrix<double, moments_count, moments_count> reordering() {
  Eigen::Matrix<double, moments_count, moments_count> out;
  out.setZero();
  for (int k = 0; k < moments_count; ++k) out(k == 9 ? 0 : k < 6 ? 4 + k : k - 5, k) = 1.0;
  return out;
}

/// A body with positive mass whose second moments about its centre are positive.
bool can_exist(const kinematics::Body& body) {
  const Eigen::Matrix3d I = body.inertia_matrix();
  const Eigen::Matrix3d second = 0.5 * I.trace() * Eigen::Matrix3d::Identity() - I;
  return body.mass > 0 && symmetric_eigen(second).values.minCoeff() > 0;
}

/// The linear problem of the payload: its ten parameters, then those of friction that may have changed.
struct PayloadProblem {
  JointRows rows;
  JointFit fit;
};

PayloadProblem solve_payload(const JointMotion& loaded, const DynamicsRegressor& regressor, const MatrixXd& bare,
                             const PayloadOptions& options) {
  const int n = regressor.joints();
  std::vector<int> columns;
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < parameters_per_joint; ++k) {
      const bool friction = options.refit_friction && (k == 10 || k == 11);
      if (friction || (i == n - 1 && k < moments_count)) columns.push_back(parameters_per_joint * i + k);
    }
  PayloadProblem out;
  out.rows = {regressor.joint_regressors(loaded, columns), columns, loaded.tau - bare, loaded.run_starts, {}};
  leave_out_rest(loaded, regressor.model().structure, options.min_speed, out.rows);
  out.fit = fit_joint_rows(out.rows, {options.estimator, options.huber, 50, 1e-6});
  return out;
}

/// Change of the estimate per unit of the arm's base parameters: -(X^T W X)^-1 X^T W Y_b.
MatrixXd arm_sensitivity(const PayloadProblem& problem, const DynamicsRegressor& regressor, const JointMotion& loaded,
                         const BaseParameters& base) {
  const Index p = problem.rows.size();
  MatrixXd A = MatrixXd::Zero(p, p), B = MatrixXd::Zero(p, base.size());
  const std::vector<JointRegressor> arm = regressor.joint_regressors(loaded, base.independent);
  const auto ours = column_positions(problem.rows.regressors, problem.rows.columns);
  const auto theirs = column_positions(arm, base.independent);
  for (std::size_t i = 0; i < arm.size(); ++i) {
    const MatrixXd& X = problem.rows.regressors[i].X;
    const double weight = 1.0 / std::pow(problem.fit.sigma[static_cast<Index>(i)], 2);
    const MatrixXd XX = weight * X.transpose() * X, XY = weight * X.transpose() * arm[i].X;
    for (Index r = 0; r < X.cols(); ++r) {
      const int to = ours[i][static_cast<std::size_t>(r)];
      for (Index c = 0; c < X.cols(); ++c) A(to, ours[i][static_cast<std::size_t>(c)]) += XX(r, c);
      for (Index c = 0; c < XY.cols(); ++c) B(to, theirs[i][static_cast<std::size_t>(c)]) += XY(r, c);
    }
  }
  const VectorXd scale = A.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
  const MatrixXd scaled = scale.asDiagonal() * A * scale.asDiagonal();
  return -(scale.asDiagonal() * scaled.ldlt().solve(MatrixXd(scale.asDiagonal() * B)));
}

PayloadResult to_payload(const JointMotion& loaded, const MatrixXd& bare, const PayloadProblem& problem,
                         const MatrixXd& covariance, const DynamicsRegressor& regressor) {
  PayloadResult out;
  const int n = regressor.joints(), first = parameters_per_joint * (n - 1);
  std::vector<Index> at;
  for (std::size_t k = 0; k < problem.rows.columns.size(); ++k) {
    const int c = problem.rows.columns[k];
    if (c >= first && c < first + moments_count) at.push_back(static_cast<Index>(k));
  }
  const auto P = reordering();
  out.moments = P * problem.fit.beta(at);
  out.covariance = covariance(at, at);
  std::vector<std::string> untold;
  for (const int k : problem.fit.untold)
    untold.push_back(regressor.names()[static_cast<std::size_t>(problem.rows.columns[static_cast<std::size_t>(k)])]);
  VectorXd found = VectorXd::Zero(regressor.parameters());
  found(problem.rows.columns) = problem.fit.beta;
  out.fitted = torque_error(loaded.tau, bare + regressor.torques(loaded, found));
  out.without = torque_error(loaded.tau, bare);
  out.fit.iterations = problem.fit.iterations;
  const auto whitened = [&](const MatrixXd& off) {
    return (off * problem.fit.sigma.cwiseInverse().asDiagonal()).norm() / std::sqrt(static_cast<double>(off.size()));
  };
  out.fit.initial_rms = whitened(problem.rows.tau);
  out.fit.final_rms = whitened(problem.fit.residuals);
  if (!untold.empty()) {
    out.fit.message = "the motion does not determine ";
    for (std::size_t k = 0; k < untold.size(); ++k) out.fit.message += (k ? ", " : "") + untold[k];
    return out;
  }
  out.covariance = (P * out.covariance * P.transpose()).eval();
  out.fit.status = problem.fit.converged ? FitStatus::Converged : FitStatus::MaxIterations;
  out.fit.message = problem.fit.converged ? "converged" : "the weights of the joints had not settled";
  const kinematics::InertialParameters moments = out.moments;
  out.body = kinematics::to_body(kinematics::to_moments(moments));
  out.possible = can_exist(out.body);
  if (!out.possible) out.fit.message += "; no such body can exist: the inertia is not determined well enough";
  const double single = uncertainty::covariance_inflation(1, problem.fit.freedom);
  out.mass_deviation = std::sqrt(std::max(single * out.covariance(0, 0), 0.0));
  Eigen::Matrix<double, 3, 4> D;  // of the centre by mass and first moments
  D << -out.body.com / out.body.mass, Eigen::Matrix3d::Identity() / out.body.mass;
  const Eigen::Matrix3d C = single * D * out.covariance.topLeftCorner<4, 4>() * D.transpose();
  out.com_deviation = C.diagonal().cwiseMax(0.0).cwiseSqrt();
  out.covariance *= uncertainty::covariance_inflation(moments_count, problem.fit.freedom);
  return out;
}

}  // namespace

void PayloadOptions::validate() const {
  require(estimator == Estimator::Ordinary || estimator == Estimator::Weighted || estimator == Estimator::Robust,
          "estimator: a payload is estimated with ordinary, weighted or robust");
  require(min_speed >= 0 && min_speed < 1, "min_speed must be at least 0 and below 1 [-]");
  require(huber > 0 && std::isfinite(huber), "huber must be positive [standard deviations]");
}

PayloadResult identify_payload(const JointMotion& loaded, const DynamicsModel& model, const VectorXd& parameters,
                               const PayloadOptions& options) {
  options.validate();
  loaded.validate();
  const DynamicsRegressor regressor(model);
  const MatrixXd bare = regressor.torques(loaded, parameters);
  const PayloadProblem problem = solve_payload(loaded, regressor, bare, options);
  return to_payload(loaded, bare, problem, problem.fit.covariance, regressor);
}

PayloadResult identify_payload(const JointMotion& loaded, const DynamicsResult& arm, const PayloadOptions& options) {
  require(arm.fit.usable(), "arm: the estimate may not be used: " + arm.fit.message);
  options.validate();
  loaded.validate();
  const DynamicsRegressor regressor(arm.model);
  const MatrixXd bare = regressor.torques(loaded, arm.parameters);
  const PayloadProblem problem = solve_payload(loaded, regressor, bare, options);
  MatrixXd covariance = problem.fit.covariance;
  if (problem.fit.untold.empty() && arm.covariance.allFinite()) {
    const MatrixXd K = arm_sensitivity(problem, regressor, loaded, arm.base);
    covariance += K * arm.covariance * K.transpose();
  }
  return to_payload(loaded, bare, problem, covariance, regressor);
}

}  // namespace kr5::identification
