// SPDX-License-Identifier: BSD-3-Clause
#include "friction_terms.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include <Eigen/Cholesky>

#include "joint_fit.hpp"

namespace kr5::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Columns of friction of one joint for a choice of terms.
MatrixXd friction_columns(const DynamicsModel& model, int joint, const JointTerms& terms, const JointMotion& motion,
                          const MatrixXd& load, double least_speed) {
  DynamicsModel one = model;
  one.terms.assign(static_cast<std::size_t>(model.joints()), {false, false, false});
  one.terms[static_cast<std::size_t>(joint)] = terms;
  one.terms[static_cast<std::size_t>(joint)].rotor_inertia = false;
  const DynamicsRegressor regressor(one);
  std::vector<int> columns = {parameters_per_joint * joint + 10, parameters_per_joint * joint + 11};
  for (int c = parameters_per_joint * model.joints(); c < regressor.parameters(); ++c) columns.push_back(c);
  MatrixXd X = regressor.joint_regressors(motion, columns, load)[static_cast<std::size_t>(joint)].X;
  X.array().colwise() *= moving_samples(motion.qd.col(joint), least_speed);
  return X;
}

/// Squared error of each block when it is predicted from the others.
VectorXd left_out_errors(const MatrixXd& X, const VectorXd& y, int blocks) {
  const Index p = X.cols(), n = X.rows();
  std::vector<MatrixXd> A;
  std::vector<VectorXd> b;
  MatrixXd A_all = MatrixXd::Zero(p, p);
  VectorXd b_all = VectorXd::Zero(p), out(blocks);
  const auto first = [&](int k) { return n * k / blocks; };
  for (int k = 0; k < blocks; ++k) {
    const auto rows = X.middleRows(first(k), first(k + 1) - first(k));
    A.push_back(rows.transpose() * rows);
    b.push_back(rows.transpose() * y.segment(first(k), rows.rows()));
    A_all += A.back();
    b_all += b.back();
  }
  const VectorXd scale = A_all.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
  for (int k = 0; k < blocks; ++k) {
    MatrixXd left = scale.asDiagonal() * (A_all - A[static_cast<std::size_t>(k)]) * scale.asDiagonal();
    left.diagonal().array() += 1e-10;  // columns that the other blocks do not tell
    const VectorXd beta =
        scale.cwiseProduct(left.ldlt().solve(scale.cwiseProduct(b_all - b[static_cast<std::size_t>(k)])));
    const Index count = first(k + 1) - first(k);
    out[k] = (y.segment(first(k), count) - X.middleRows(first(k), count) * beta).squaredNorm();
  }
  return out;
}

/// Ways to add one term, each with the values of its shape that are tried.
std::vector<JointTerms> extensions(const JointTerms& now, const JointMotion& motion, int joint, double least_speed) {
  std::vector<JointTerms> out;
  const auto with = [&](const std::function<void(JointTerms&)>& change) {
    JointTerms more = now;
    change(more);
    out.push_back(more);
  };
  if (!now.offset) with([](JointTerms& t) { t.offset = true; });
  if (!now.direction) with([](JointTerms& t) { t.direction = true; });
  if (!now.load) with([](JointTerms& t) { t.load = true; });
  const double fastest = motion.qd.col(joint).cwiseAbs().maxCoeff();
  // A friction of lower speeds than those that are left out would be extrapolated to them.
  const double slowest = 2 * least_speed * root_mean_square(motion.qd.col(joint));
  if (now.stribeck_velocity == 0 && fastest > 0)
    for (double part = 0.6; part > std::max(0.01, slowest / fastest); part *= 0.6)
      with([&](JointTerms& t) { t.stribeck_velocity = part * fastest; });
  const double span = motion.t.maxCoeff() - motion.t.minCoeff();
  if (now.thermal_time_constant == 0 && span > 0 && (now.coulomb || now.viscous))
    for (const double part : {0.2, 0.5, 1.2}) with([&](JointTerms& t) { t.thermal_time_constant = part * span; });
  return out;
}

/// Of the mean of values.
double standard_error(const VectorXd& values) {
  const auto count = static_cast<double>(values.size());
  return std::sqrt((values.array() - values.mean()).square().sum() / (count - 1) / count);
}

struct Extension {
  JointTerms terms;
  VectorXd errors;  ///< Of each block, left out; empty: there is none.
  Index columns = 0;
};

/// The one with the least error, or one with fewer columns whose error is within a standard error of it.
Extension best_extension(const DynamicsModel& model, int joint, const JointTerms& now, const JointMotion& motion,
                         const MatrixXd& load, const VectorXd& y, int blocks, double least_speed) {
  std::vector<Extension> all;
  for (const JointTerms& terms : extensions(now, motion, joint, least_speed)) {
    const MatrixXd X = friction_columns(model, joint, terms, motion, load, least_speed);
    all.push_back({terms, left_out_errors(X, y, blocks), X.cols()});
  }
  if (all.empty()) return {};
  const auto less = [](const Extension& a, const Extension& b) { return a.errors.sum() < b.errors.sum(); };
  const Extension least = *std::min_element(all.begin(), all.end(), less);
  Extension out = least;
  for (const Extension& other : all) {
    const VectorXd loss = other.errors - least.errors;
    const bool simpler = other.columns < out.columns || (other.columns == out.columns && less(other, out));
    if (simpler && loss.mean() <= standard_error(loss)) out = other;
  }
  return out;
}

}  // namespace

std::vector<JointTerms> choose_friction_terms(const DynamicsModel& model, const JointMotion& motion,
                                              const MatrixXd& residuals, const MatrixXd& load, int blocks,
                                              double least_speed) {
  std::vector<JointTerms> chosen = model.terms;
  chosen.resize(static_cast<std::size_t>(model.joints()));
  for (int i = 0; i < model.joints(); ++i) {
    JointTerms& now = chosen[static_cast<std::size_t>(i)];
    const VectorXd y = residuals.col(i);
    VectorXd errors = left_out_errors(friction_columns(model, i, now, motion, load, least_speed), y, blocks);
    while (true) {
      const Extension best = best_extension(model, i, now, motion, load, y, blocks, least_speed);
      if (best.errors.size() == 0) break;
      const VectorXd gain = errors - best.errors;
      // Beside its own standard error a term must be worth its place: a hundredth of what is left.
      if (!(gain.mean() > standard_error(gain)) || !(gain.sum() > 0.01 * errors.sum())) break;
      now = best.terms;
      errors = best.errors;
    }
  }
  return chosen;
}

}  // namespace kr5::identification
