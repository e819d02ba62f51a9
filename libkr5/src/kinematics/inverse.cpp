// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/kinematics/inverse.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include <Eigen/Cholesky>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/kinematics/jacobian.hpp>

#include "kinematics/closed_form.hpp"

namespace kr5::kinematics {
namespace {

using Eigen::VectorXd;

constexpr double turn = 2 * std::numbers::pi;

/// Options with every vector filled.
struct Task {
  const DhChain& chain;
  const Pose& T_base_flange;
  InverseOptions options;
  VectorXd lower, upper, near;
};

Task task(const DhChain& chain, const Pose& T_base_flange, const InverseOptions& options) {
  const auto n = static_cast<Eigen::Index>(chain.joints.size());
  const double inf = std::numeric_limits<double>::infinity();
  const auto filled = [&](const VectorXd& v, double value) -> VectorXd {
    return v.size() ? v : VectorXd::Constant(n, value);
  };
  return {chain,
          T_base_flange,
          options,
          filled(options.lower, -inf),
          filled(options.upper, inf),
          filled(options.near, 0.0)};
}

/// The full turn of a joint that is within the limits and nearest to `near`, or nearest to the limits.
double best_turn(double q, double lower, double upper, double near) {
  const double wanted = q + turn * std::round((near - q) / turn);
  const auto excess = [&](double value) { return std::max({lower - value, value - upper, 0.0}); };
  double best = wanted;
  for (const double value : {wanted - turn, wanted + turn, q, q - turn, q + turn})
    if (excess(value) < excess(best)) best = value;
  return best;
}

Vector6 error(const Task& task, const VectorXd& q) {
  const Pose T = task.chain.flange(q);
  return (Vector6() << task.T_base_flange.translation() - T.translation(),
          log_rotation(task.T_base_flange.linear() * T.linear().transpose()))
      .finished();
}

void complete(const Task& task, Posture& posture) {
  for (Eigen::Index i = 0; i < posture.q.size(); ++i)
    if (task.chain.joints[static_cast<std::size_t>(i)].type == JointType::Revolute)
      posture.q[i] = best_turn(posture.q[i], task.lower[i], task.upper[i], task.near[i]);
  posture.outside_limits = outside_limits(posture.q, task.lower, task.upper);
  const Vector6 e = error(task, posture.q);
  posture.position_error = e.head<3>().norm();
  posture.rotation_error = e.tail<3>().norm();
}

bool reached(const Task& task, const Vector6& e) {
  return e.head<3>().norm() <= task.options.position_tolerance && e.tail<3>().norm() <= task.options.rotation_tolerance;
}

/// One step of damped least squares; joints that would leave their limits stand still and the others do without them.
VectorXd damped_step(const Task& task, const VectorXd& q, const Vector6& e, double damping) {
  Jacobian J = jacobian(task.chain, q);
  VectorXd step;
  for (Eigen::Index round = 0; round <= q.size(); ++round) {
    const Matrix6 A = J * J.transpose() + damping * Matrix6::Identity();
    step = J.transpose() * A.ldlt().solve(e);
    bool held = false;
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      const bool out = (q[i] <= task.lower[i] && step[i] < 0) || (q[i] >= task.upper[i] && step[i] > 0);
      if (!out) continue;
      J.col(i).setZero();
      held = true;
    }
    if (!held) break;
  }
  return (q + step).cwiseMax(task.lower).cwiseMin(task.upper);
}

/// A loop of its own: core/levenberg_marquardt.hpp scales each joint, and leads redundant arms to other postures.
std::optional<VectorXd> descend(const Task& task, VectorXd q) {
  Vector6 e = error(task, q);
  double damping = 1e-3;
  for (int k = 0; k < task.options.iterations && !reached(task, e); ++k) {
    const VectorXd next = damped_step(task, q, e, damping * std::min(1.0, e.squaredNorm()));
    const Vector6 e_next = error(task, next);
    if (e_next.norm() < e.norm()) {
      q = next;
      e = e_next;
      damping = std::max(damping / 5, 1e-12);
    } else {
      damping *= 8;
      if (damping > 1e9) break;
    }
  }
  if (!reached(task, e)) return {};
  return q;
}

VectorXd random_start(const Task& task, Random& random) {
  VectorXd q(task.near.size());
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    const bool revolute = task.chain.joints[static_cast<std::size_t>(i)].type == JointType::Revolute;
    const double reach = revolute ? std::numbers::pi : 1.0;
    q[i] = random.uniform(std::isfinite(task.lower[i]) ? task.lower[i] : task.near[i] - reach,
                          std::isfinite(task.upper[i]) ? task.upper[i] : task.near[i] + reach);
  }
  return q;
}

InverseResult iterate(const Task& task) {
  Random random(task.options.seed);
  VectorXd start = task.near.cwiseMax(task.lower).cwiseMin(task.upper);
  InverseResult result;
  for (int k = 0; k < task.options.starts; ++k) {
    if (const auto q = descend(task, start)) {
      Posture posture{*q};
      complete(task, posture);
      const VectorXd sizes = manipulability(jacobian(task.chain, *q)).singular_values;
      if (sizes.tail<1>()[0] < 1e-6 * sizes[0]) posture.singularity = Singularity::Unnamed;
      result.postures.push_back(posture);
      result.status = InverseStatus::Solved;
      return result;
    }
    start = random_start(task, random);
  }
  return result;
}

}  // namespace

void InverseOptions::validate(int joints) const {
  const auto sized = [&](const VectorXd& v, const char* name) {
    require(v.size() == 0 || v.size() == joints, std::string(name) + " has " + std::to_string(v.size()) +
                                                     " values, the chain " + std::to_string(joints) + " joints");
  };
  sized(lower, "lower");
  sized(upper, "upper");
  sized(near, "near");
  if (lower.size() && upper.size()) require((lower.array() <= upper.array()).all(), "lower must not be above upper");
  require(singular_within > 0.0 && singular_within < 0.1, "singular_within must be in (0, 0.1)");
  require(position_tolerance > 0.0, "position_tolerance must be positive");
  require(rotation_tolerance > 0.0, "rotation_tolerance must be positive");
  require(iterations > 0, "iterations must be positive");
  require(starts > 0, "starts must be positive");
}

std::optional<Eigen::VectorXd> InverseResult::nearest() const {
  if (postures.empty() || !postures.front().usable()) return std::nullopt;
  return postures.front().q;
}

InverseResult inverse_kinematics(const DhChain& chain, const Pose& T_base_flange, const InverseOptions& options) {
  require(!chain.joints.empty(), "the chain has no joints");
  options.validate(static_cast<int>(chain.joints.size()));
  require(T_base_flange.matrix().allFinite() && is_rotation(T_base_flange.linear()),
          "T_base_flange must be a rigid motion");
  const Task given = task(chain, T_base_flange, options);
  auto all = closed_form(chain, T_base_flange, given.near, options.singular_within);
  if (!all) return iterate(given);
  InverseResult result{InverseStatus::OutOfReach, true, *std::move(all)};
  for (Posture& posture : result.postures) complete(given, posture);
  const auto order = [&](const Posture& a, const Posture& b) {
    if (a.usable() != b.usable()) return a.usable();
    return (a.q - given.near).norm() < (b.q - given.near).norm();
  };
  std::sort(result.postures.begin(), result.postures.end(), order);
  if (!result.postures.empty())
    result.status = result.postures.front().usable() ? InverseStatus::Solved : InverseStatus::OutsideLimits;
  return result;
}

}  // namespace kr5::kinematics
