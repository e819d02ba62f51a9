// SPDX-License-Identifier: BSD-3-Clause
#include "load_delay.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>

#include <kr5/arm_log/measured_positions.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/identification/dynamics.hpp>

#include "joint_columns.hpp"
#include "neighbour_correlation.hpp"

namespace kr5::arm_log {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double clear_delay = 10.0;     // gain of log likelihood: chance alone, chi-square / 2, reaches it in 1e-5
constexpr double max_delay = 0.1;        // that is searched [s]
constexpr double min_delay_step = 4e-3;  // of that search [s]
constexpr double fineness = 0.02;        // of a step, to which the delay is found
constexpr double rounding_share = 3e-3;  // of the spread of a torque, below which a residual is rounding

identification::DynamicsModel model_to_fit(const cell::Cell& cell) {
  identification::JointTerms terms;
  terms.offset = true;
  identification::DynamicsModel out;
  out.chain = cell::nominal_chain(cell);
  out.gravity = cell.robot.gravity;
  out.structure = cell.drives->structure;
  out.terms.assign(static_cast<std::size_t>(cell.robot.joints()), terms);
  return out;
}

/// What a prediction leaves, 0 where the side of dry friction is not known; of the RMS of the other rows.
MatrixXd left_where_known(const identification::JointMotion& motion, const MatrixXd& predicted) {
  MatrixXd out = motion.tau - predicted;
  if (motion.speed_noise.size() == 0) return out;
  for (Index k = 0; k < out.cols(); ++k) {
    const Eigen::ArrayXd known = known_signs(motion.qd.col(k).array(), motion.speed_noise[k]);
    out.col(k).array() *= known * std::sqrt(static_cast<double>(known.size()) / std::max(known.sum(), 1.0));
  }
  return out;
}

/// What the best arm leaves of torques that were logged late.
class DelayedFit {
 public:
  DelayedFit(const cell::Cell& cell, const std::vector<cell::Experiment>& motions)
      : cell_(cell), motions_(motions), model_(model_to_fit(cell)) {
    options_.held_out = 0.0;
    choose_friction();
  }

  BestArm at(double delay) const {
    const identification::JointMotion motion = merged_motion(cell_, motions_, delay);
    BestArm out{{}, delay, identification::identify_dynamics(motion, model_, options_)};
    if (out.found.fit.usable()) out.left = left_where_known(motion, out.found.predicted);
    return out;
  }

 private:
  /// Friction terms beyond dry and viscous friction that the motions show, for all delays alike.
  void choose_friction() {
    identification::DynamicsOptions choosing = options_;
    choosing.choose_terms = true;
    const auto found = identification::identify_dynamics(merged_motion(cell_, motions_), model_, choosing);
    if (found.fit.usable()) model_.terms = found.model.terms;
  }

  const cell::Cell& cell_;
  const std::vector<cell::Experiment>& motions_;
  identification::DynamicsModel model_;
  identification::DynamicsOptions options_;
};

/// Negative logarithm of the likelihood of what an arm leaves, of normal residuals as correlated as on time.
class DelayLikelihood {
 public:
  DelayLikelihood(const MatrixXd& on_time, const VectorXd& spread, const std::vector<int>& live) : live_(live) {
    for (const int k : live) {
      const double correlation = neighbour_correlation(on_time.col(k));
      independent_.push_back(static_cast<double>(on_time.rows()) * (1 - correlation) / (1 + correlation));
      floor_.push_back(std::pow(rounding_share * spread[k], 2) + std::numeric_limits<double>::min());
    }
  }

  double cost(const MatrixXd& left) const {
    if (left.size() == 0) return std::numeric_limits<double>::infinity();
    double out = 0.0;
    for (std::size_t j = 0; j < live_.size(); ++j)
      out +=
          independent_[j] * std::log(left.col(live_[j]).squaredNorm() / static_cast<double>(left.rows()) + floor_[j]);
    return out / 2;
  }

 private:
  std::vector<int> live_;
  std::vector<double> independent_, floor_;
};

/// Golden section for the least cost between two delays [s].
double min_between(double low, double high, double tolerance, const std::function<double(double)>& cost) {
  constexpr double golden = std::numbers::phi - 1;
  double a = high - golden * (high - low), b = low + golden * (high - low);
  double at_a = cost(a), at_b = cost(b);
  while (high - low > tolerance) {
    if (at_a < at_b) {
      high = b, b = a, at_b = at_a;
      a = high - golden * (high - low), at_a = cost(a);
    } else {
      low = a, a = b, at_a = at_b;
      b = low + golden * (high - low), at_b = cost(b);
    }
  }
  return at_a < at_b ? a : b;
}

/// The delay of the least cost [s]: a walk from none, then between its steps; none where the walk does not end.
double best_delay(double step, const std::function<double(double)>& cost) {
  std::map<int, double> known;
  const auto at_step = [&](int k) {
    const auto found = known.find(k);
    return found != known.end() ? found->second : known[k] = cost(k * step);
  };
  int at = 0;
  while (true) {
    int best = at;
    for (const int k : {at - 1, at + 1})
      if (at_step(k) < at_step(best)) best = k;
    if (best == at) break;
    at = best;
    if (std::abs(at) * step > max_delay) return 0.0;
  }
  return min_between((at - 1) * step, (at + 1) * step, fineness * step, cost);
}

/// Standard deviation of each column over all motions.
VectorXd spread_of_torques(const cell::Cell& cell, const std::vector<cell::Experiment>& motions) {
  const MatrixXd tau = merged_motion(cell, motions).tau;
  return (tau.rowwise() - tau.colwise().mean()).cwiseAbs2().colwise().mean().cwiseSqrt().transpose();
}

}  // namespace

BestArm best_arm_with_delay(const cell::Cell& cell, const std::vector<cell::Experiment>& motions,
                            const std::vector<int>& live) {
  const DelayedFit fit(cell, motions);
  const BestArm on_time = fit.at(0.0);
  if (on_time.left.size() == 0 || live.empty()) return on_time;
  const DelayLikelihood likelihood(on_time.left, spread_of_torques(cell, motions), live);
  const auto cost = [&](double delay) { return likelihood.cost(delay == 0.0 ? on_time.left : fit.at(delay).left); };
  const double row = middle_step(motions.front().data.column("t"));
  const double delay = best_delay(std::max(row, min_delay_step), cost);
  if (std::abs(delay) < row / 2) return on_time;
  BestArm delayed = fit.at(delay);
  return likelihood.cost(on_time.left) - likelihood.cost(delayed.left) >= clear_delay ? delayed : on_time;
}

}  // namespace kr5::arm_log
