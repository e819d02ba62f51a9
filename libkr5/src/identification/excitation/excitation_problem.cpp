// SPDX-License-Identifier: BSD-3-Clause
#include "identification/excitation/excitation_problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/physics/friction.hpp>

#include "identification/dynamics/column_grouping.hpp"

namespace kr5::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double no_motion = 1e300;  // value of a motion that leaves a parameter untold

void require_limit(const VectorXd& values, int n, const char* name, const char* unit) {
  const std::string field = std::string("limits.") + name;
  require(values.size() == n, field + ": found " + std::to_string(values.size()) +
                                  " values, expected one a joint: " + std::to_string(n) + " [" + unit + "]");
  for (Index j = 0; j < n; ++j)
    require(values[j] > 0, field + ": joint " + std::to_string(j + 1) + " must have a positive limit [" + unit + "]");
}

/// Columns in the order of eq. 4.36: of each joint inertia, first moment, mass, Coulomb, viscous, rotor.
std::vector<Index> regressor_order(Index n, const ExcitationOptions& options) {
  constexpr Index each = kinematics::inertial_parameter_count;
  std::vector<Index> out;
  for (Index j = 0; j < n; ++j) {
    for (const Index c : {4, 5, 6, 7, 8, 9, 1, 2, 3, 0}) out.push_back(each * j + c);
    if (options.friction) out.push_back(each * n + j);
    if (options.friction) out.push_back((each + 1) * n + j);
    if (options.rotors) out.push_back((each + 2) * n + j);
  }
  return out;
}

JointMotion at_rest(const VectorXd& q) {
  JointMotion out;
  out.t = VectorXd::Zero(1);
  out.q = q.transpose();
  out.qd = out.qdd = MatrixXd::Zero(1, q.size());
  return out;
}

}  // namespace

ExcitationProblem::ExcitationProblem(const cell::Cell& cell, const MotionLimits& limits,
                                     const ExcitationOptions& options)
    : cell_(cell),
      options_(options),
      chain_(cell::nominal_chain(cell)),
      regressor_(chain_, cell.robot.gravity),
      clearance_(chain_, limits_, options) {
  const int n = cell.robot.joints();
  require(n > 0, "cell.robot: the arm has no joint");
  require(options.torque_noise.size() == 0 || options.torque_noise.size() == n,
          "torque_noise: found " + std::to_string(options.torque_noise.size()) +
              " values, expected one a joint: " + std::to_string(n) + " [N m or N]");
  weight_ = options.torque_noise.size() ? VectorXd(options.torque_noise.cwiseInverse()) : VectorXd::Ones(n);
  set_limits(limits);
  check_start();
  find_base();
}

void ExcitationProblem::set_limits(const MotionLimits& limits) {
  const int n = cell_.robot.joints();
  limits_ = limits;
  for (const auto& [values, name] : {std::pair{&limits.lower, "lower"}, std::pair{&limits.upper, "upper"}})
    require(values->size() == n, std::string("limits.") + name + ": found " + std::to_string(values->size()) +
                                     " values, expected one a joint: " + std::to_string(n) + " [rad or m]");
  for (int j = 0; j < n; ++j) {
    double &low = limits_.lower[j], &high = limits_.upper[j];
    const std::string joint = "joint " + std::to_string(j + 1);
    const bool turns = cell_.robot.dh[static_cast<std::size_t>(j)].type == kinematics::JointType::Revolute;
    require(turns || (std::isfinite(low) && std::isfinite(high)),
            "limits: " + joint + " is a slide without limits of its position; give limits.lower and limits.upper [m]");
    if (!std::isfinite(low)) low = std::isfinite(high) ? high - 2 * M_PI : -M_PI;
    if (!std::isfinite(high)) high = low + 2 * M_PI;
    require(low < high, "limits: the range of " + joint + " is empty: lower must be less than upper [rad or m]");
    const double free = 0.5 * (1 - options_.limit_share) * (high - low);
    low += free;
    high -= free;
  }
  require_limit(limits.speed, n, "speed", "rad/s or m/s");
  require(limits.speed.allFinite(), "limits.speed must be finite: a motion needs limited speeds [rad/s or m/s]");
  if (limits.acceleration.size() == 0) limits_.acceleration = limits.speed / options_.ramp_time;
  require_limit(limits_.acceleration, n, "acceleration", "rad/s^2 or m/s^2");
  if (limits.torque.size() > 0) {
    require_limit(limits.torque, n, "torque", "N m or N");
    require(!cell_.robot.links.empty(),
            "limits.torque: the cell has no masses (robot.links), so no torque can be foreseen");
  }
  limits_.speed *= options_.limit_share;
  limits_.acceleration *= options_.limit_share;
  limits_.torque *= options_.limit_share;
}

void ExcitationProblem::check_start() const {
  if (options_.start.size() == 0) return;
  require(options_.start.size() == joints(), "start: found " + std::to_string(options_.start.size()) +
                                                 " values, expected one a joint: " + std::to_string(joints()));
  for (int j = 0; j < joints(); ++j)
    require(options_.start[j] >= limits_.lower[j] && options_.start[j] <= limits_.upper[j],
            "start: joint " + std::to_string(j + 1) + " at " + std::to_string(options_.start[j]) +
                " is outside of the range " + std::to_string(limits_.lower[j]) + " to " +
                std::to_string(limits_.upper[j]) + " that limit_share leaves [rad or m]");
  const NearestApproach approach = clearance_.along(at_rest(options_.start));
  require(approach.clearance >= options_.margin,
          "start: clearance of " + approach.where + " is " + std::to_string(approach.clearance) +
              ", expected at least the margin, " + std::to_string(options_.margin) + " [m]");
}

void ExcitationProblem::find_base() {
  const Index n = joints(), samples = 20 + 10 * n;
  Random random(1);
  JointMotion states;
  states.t = VectorXd::LinSpaced(samples, 0.0, 1.0);
  states.q = states.qd = states.qdd = MatrixXd::Zero(samples, n);
  for (Index k = 0; k < samples; ++k)
    for (Index j = 0; j < n; ++j) {
      states.q(k, j) = random.uniform(limits_.lower[j], limits_.upper[j]);
      states.qd(k, j) = random.uniform(-1.0, 1.0) * limits_.speed[j];
      states.qdd(k, j) = random.uniform(-1.0, 1.0) * limits_.acceleration[j];
    }
  MatrixXd rows(n, (kinematics::inertial_parameter_count + 3) * n), A(samples * n, rows.cols());
  for (Index k = 0; k < samples; ++k) {
    fill_rows(states, k, rows);
    A.middleRows(k * n, n) = rows;
  }
  base_ = grouped_columns(A, regressor_order(n, options_)).kept;
}

void ExcitationProblem::fill_rows(const JointMotion& states, Index k, MatrixXd& Y) {
  const Index n = joints(), inertial = regressor_.parameters();
  const VectorXd qd = states.qd.row(k), qdd = states.qdd.row(k);
  regressor_.evaluate(states.q.row(k).transpose(), qd, qdd, Y.leftCols(inertial));
  Y.rightCols(Y.cols() - inertial).setZero();
  for (Index j = 0; j < n; ++j) {
    Y(j, inertial + j) = physics::smoothed_sign(qd[j]);
    Y(j, inertial + n + j) = qd[j];
    Y(j, inertial + 2 * n + j) = qdd[j];
  }
}

MatrixXd ExcitationProblem::information(const JointMotion& states) {
  const Index n = joints(), p = base_parameters();
  MatrixXd rows(n, regressor_.parameters() + 3 * n), A(states.samples() * n, p);
  for (Index k = 0; k < states.samples(); ++k) {
    fill_rows(states, k, rows);
    for (Index c = 0; c < p; ++c)
      A.col(c).segment(k * n, n) = weight_.cwiseProduct(rows.col(base_[static_cast<std::size_t>(c)]));
  }
  MatrixXd out = MatrixXd::Zero(p, p);
  out.selfadjointView<Eigen::Lower>().rankUpdate(A.transpose());
  out.triangularView<Eigen::StrictlyUpper>() = out.transpose();
  return out;
}

double ExcitationProblem::condition(const MatrixXd& information, bool scaled) const {
  const VectorXd length = information.diagonal().cwiseSqrt();
  if (!(length.minCoeff() > 0)) return std::numeric_limits<double>::infinity();
  const VectorXd by = scaled ? VectorXd(length.cwiseInverse()) : VectorXd::Ones(length.size());
  const VectorXd values = symmetric_eigen(MatrixXd(by.asDiagonal() * information * by.asDiagonal())).values;
  const double least = values[0], greatest = values[values.size() - 1];
  return least > 1e-15 * greatest ? std::sqrt(greatest / least) : std::numeric_limits<double>::infinity();
}

double ExcitationProblem::shown_condition(const MatrixXd& information) const {
  return condition(information, options_.criterion != ExcitationCriterion::ConditionUnscaled);
}

double ExcitationProblem::value(const MatrixXd& mean_information) const {
  if (options_.criterion != ExcitationCriterion::Determinant) {
    const double out = shown_condition(mean_information);
    return std::isfinite(out) ? out : no_motion;
  }
  const Eigen::LLT<MatrixXd> factor(mean_information);
  if (factor.info() != Eigen::Success) return no_motion;
  return -2 * factor.matrixLLT().diagonal().array().log().mean();
}

MatrixXd ExcitationProblem::torques(const JointMotion& states) const {
  return cell_.robot.links.empty() ? MatrixXd() : nominal_torques(cell_, states);
}

double ExcitationProblem::lowest(const JointMotion& states) const {
  double out = std::numeric_limits<double>::infinity();
  const kinematics::Rows T = chain_.flanges(kinematics::Rows(states.q));
  for (Index k = 0; k < T.rows(); ++k) {
    out = std::min(out, T(k, 11));
    for (const auto& point : options_.points.colwise())
      out = std::min(out, T(k, 8) * point.x() + T(k, 9) * point.y() + T(k, 10) * point.z() + T(k, 11));
  }
  return out;
}

std::string ExcitationProblem::objection(const JointMotion& states) const {
  if (lowest(states) < options_.lowest) return "a guarded point below `lowest`";
  const NearestApproach approach = clearance_.along(states, options_.margin);
  if (approach.clearance < options_.margin) return "the clearance of " + approach.where;
  return torque_objection(states);
}

std::string ExcitationProblem::torque_objection(const JointMotion& states) const {
  if (limits_.torque.size() == 0) return "";
  const VectorXd peak = torques(states).cwiseAbs().colwise().maxCoeff();
  for (Index j = 0; j < joints(); ++j)
    if (peak[j] > limits_.torque[j]) return "the torque of joint " + std::to_string(j + 1);
  return "";
}

VectorXd ExcitationProblem::clear_posture(Random& random) const {
  constexpr int tries = 100;
  VectorXd q;
  for (int k = 0; k < tries; ++k) {
    q = VectorXd::NullaryExpr(joints(), [&](Index j) { return random.uniform(limits_.lower[j], limits_.upper[j]); });
    if (objection(at_rest(q)).empty()) break;
  }
  return q;
}

}  // namespace kr5::identification
