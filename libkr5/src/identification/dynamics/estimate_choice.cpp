// SPDX-License-Identifier: BSD-3-Clause
#include "identification/dynamics/estimate_choice.hpp"

#include <cmath>
#include <limits>

#include "identification/dynamics/joint_fit.hpp"

namespace kr5::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd without_rows(const MatrixXd& values, Index first, Index count) {
  if (values.size() == 0) return values;
  MatrixXd out(values.rows() - count, values.cols());
  out << values.topRows(first), values.bottomRows(values.rows() - first - count);
  return out;
}

/// A motion without the samples [first, first + count), between which it is interrupted.
JointMotion without_part(const JointMotion& motion, Index first, Index count) {
  JointMotion out{without_rows(motion.t, first, count),   without_rows(motion.q, first, count),
                  without_rows(motion.qd, first, count),  without_rows(motion.qdd, first, count),
                  without_rows(motion.tau, first, count), {0}};
  out.temperature = without_rows(motion.temperature, first, count);
  out.speed_noise = motion.speed_noise;
  for (const int start : motion.run_starts)
    if (start > 0 && start < first) out.run_starts.push_back(start);
  if (first > 0 && first < out.samples()) out.run_starts.push_back(static_cast<int>(first));
  for (const int start : motion.run_starts)
    if (start > first + count) out.run_starts.push_back(static_cast<int>(start - count));
  return out;
}

constexpr int thirds = 3;

/// Squared errors of each joint, summed over the samples of all thirds; infinite where a third could not be predicted.
struct JudgedOptions {
  DynamicsOptions options;
  VectorXd squares;

  double score() const { return squares.allFinite() ? squares.array().max(1e-300).log().sum() : endless; }
  static constexpr double endless = std::numeric_limits<double>::infinity();
};

std::vector<JudgedOptions> candidates_of(const DynamicsOptions& options, int joints) {
  std::vector<JudgedOptions> out;
  for (const double min_speed : {0.0, 0.01, 0.02, 0.04}) {
    DynamicsOptions one = options;
    one.held_out = 0.0;
    one.choose_estimate = false;
    one.min_speed = min_speed;
    one.estimator = Estimator::Weighted;
    out.push_back({one, VectorXd::Zero(joints)});
    one.estimator = Estimator::Consistent;
    for (const double spread : {0.25, 0.5, 1.0, 2.0}) {
      if (options.prior_bodies.empty()) continue;
      one.prior_spread = spread;
      out.push_back({one, VectorXd::Zero(joints)});
    }
  }
  return out;
}

}  // namespace

DynamicsOptions choose_estimate(const JointMotion& motion, const DynamicsModel& model, const DynamicsOptions& options) {
  std::vector<JudgedOptions> candidates = candidates_of(options, motion.joints());
  for (int third = 0; third < thirds; ++third) {
    const Index first = motion.samples() * third / thirds, count = motion.samples() * (third + 1) / thirds - first;
    const JointMotion others = without_part(motion, first, count), left_out = part_of(motion, first, count);
    DynamicsModel chosen = model;
    for (JudgedOptions& one : candidates) {
      const bool weighted = one.options.estimator == Estimator::Weighted;  // it stands before those of its least speed
      DynamicsOptions own = one.options;
      own.choose_terms = weighted && options.choose_terms;
      const DynamicsResult result = identify_dynamics(others, weighted ? model : chosen, own);
      if (weighted) chosen = result.model;
      if (result.fit.usable())
        one.squares += (left_out.tau - predict_torques(result, left_out)).colwise().squaredNorm().transpose();
      else
        one.squares.setConstant(JudgedOptions::endless);
    }
  }
  const JudgedOptions* best = nullptr;
  for (const JudgedOptions& one : candidates)
    if (one.score() < (best ? best->score() : JudgedOptions::endless)) best = &one;
  if (!best) return options;
  DynamicsOptions out = options;
  out.estimator = best->options.estimator;
  out.prior_spread = best->options.prior_spread;
  out.min_speed = best->options.min_speed;
  return out;
}

}  // namespace kr5::identification
