// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/torque_constants.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/QR>

#include <kr5/core/linear.hpp>

#include "joint_columns.hpp"
#include "neighbour_correlation.hpp"

namespace kr5::arm_log {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double shown_sigmas = 3.0;         // from which friction or an offset beside a torque constant counts
constexpr double sure_constant = 5.0;        // standard deviations that a torque constant must be above zero
constexpr double sign_change_speed = 0.002;  // over which dry friction changes its sign, as in cells [rad/s or m/s]
constexpr double min_rank = 1e-8;            // of columns of unit length

struct Slope {
  double value = 0.0;
  double deviation = std::numeric_limits<double>::infinity();
};

struct SlopeFit {
  VectorXd solution, deviations;
};

/// Least squares with columns of unit length, standard deviations for residuals as correlated as they are.
SlopeFit fit_columns(const MatrixXd& columns, const VectorXd& current) {
  VectorXd scale = columns.colwise().norm().transpose();
  scale = (scale.array() == 0).select(1.0, scale);
  const MatrixXd A = columns * scale.cwiseInverse().asDiagonal();
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> solver;
  solver.setThreshold(min_rank);
  solver.compute(A);
  const VectorXd x = solver.solve(current), left = current - A * x;
  const double correlation = neighbour_correlation(left);
  const double freedom = std::max<double>(1.0, static_cast<double>(current.size() - solver.rank()));
  const double variance = left.squaredNorm() / freedom * (1 + correlation) / (1 - correlation);
  const VectorXd spread = covariance_of(A.transpose() * A, min_rank * min_rank).diagonal();
  return {x.cwiseQuotient(scale), (variance * spread).cwiseSqrt().cwiseQuotient(scale)};
}

/// Slope of current over torque; friction and offset stand beside it as far as the log shows any.
Slope torque_slope(const VectorXd& torque, const VectorXd& speed, const VectorXd& current) {
  std::vector<VectorXd> columns = {torque, (speed / sign_change_speed).array().tanh(), speed,
                                   VectorXd::Ones(speed.size())};
  while (true) {
    MatrixXd A(torque.size(), static_cast<Index>(columns.size()));
    for (std::size_t c = 0; c < columns.size(); ++c) A.col(static_cast<Index>(c)) = columns[c];
    const SlopeFit fit = fit_columns(A, current);
    const VectorXd sure = fit.solution.cwiseAbs().cwiseQuotient(fit.deviations.cwiseMax(1e-300));
    Index weakest = 0;
    const bool stays = columns.size() == 1 || sure.tail(sure.size() - 1).minCoeff(&weakest) > shown_sigmas;
    if (stays) return {fit.solution[0], fit.deviations[0]};
    columns.erase(columns.begin() + 1 + weakest);
  }
}

}  // namespace

int TorqueConstants::first_unknown() const {
  for (Index k = 0; k < values.size(); ++k)
    if (!(values[k] > sure_constant * deviations[k])) return static_cast<int>(k);
  return -1;
}

TorqueConstants estimate_torque_constants(const cell::Recording& recording) {
  const int n = recording.cell.robot.joints();
  std::vector<cell::Experiment> motions;
  std::vector<MatrixXd> loads, currents;
  for (const cell::Experiment& e : recording.experiments) {
    if (e.kind != cell::Kind::Motion || e.split != cell::Split::Fit || !has_column(e, "i1")) continue;
    motions.push_back(e);
    loads.push_back(link_loads(recording.cell, e));
    currents.push_back(joint_columns(e, "i", n));
  }
  if (motions.empty()) return {};
  const identification::JointMotion motion = merged_motion(recording.cell, motions);
  const MatrixXd torque = stacked_rows(loads), current = stacked_rows(currents);
  TorqueConstants out{VectorXd::Zero(n), VectorXd::Constant(n, std::numeric_limits<double>::infinity())};
  for (int k = 0; k < n; ++k) {
    const Slope slope = torque_slope(torque.col(k), motion.qd.col(k), current.col(k));
    if (!(slope.value > 0)) continue;
    out.values[k] = 1 / slope.value;
    out.deviations[k] = slope.deviation / (slope.value * slope.value);
  }
  return out;
}

bool lacks_torque_constants(const cell::Cell& cell) {
  return cell.drives && (cell.drives->torque_constant.array() == 1.0).all();
}

}  // namespace kr5::arm_log
