// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/excitation.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/physics/effective_arm.hpp>
#include <kr5/physics/friction.hpp>
#include <kr5/physics/motors.hpp>

#include "identification/excitation/excitation_problem.hpp"
#include "identification/excitation/fourier_search.hpp"
#include "identification/excitation/point_search.hpp"

namespace kr5::identification {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double final_interval = 2e-3;  // at which the finished motion is looked at [s]

/// Figures of the finished motion, at a finer step than the search took.
void measure(Excitation& out, ExcitationProblem& problem, const MotionLimits& full) {
  const JointMotion fine = out.motion.sampled(final_interval);
  const Eigen::MatrixXd information = problem.information(fine) / static_cast<double>(fine.samples());
  out.condition = problem.condition(information, true);
  out.condition_unscaled = problem.condition(information, false);
  out.log_determinant = 2 * Eigen::LLT<Eigen::MatrixXd>(information).matrixLLT().diagonal().array().log().mean();
  const auto peak = [](const Eigen::MatrixXd& values) -> VectorXd { return values.cwiseAbs().colwise().maxCoeff(); };
  out.position_use =
      (fine.q.colwise().maxCoeff() - fine.q.colwise().minCoeff()).transpose().cwiseQuotient(full.upper - full.lower);
  out.speed_use = peak(fine.qd).cwiseQuotient(full.speed);
  out.acceleration_use = peak(fine.qdd).cwiseQuotient(full.acceleration);
  if (const Eigen::MatrixXd torques = problem.torques(fine); torques.size() > 0) out.torque_peak = peak(torques);
  if (full.torque.size() > 0) out.torque_use = out.torque_peak.cwiseQuotient(full.torque);
  out.lowest = problem.lowest(fine);
  const NearestApproach approach = problem.nearest_approach(fine);
  out.clearance = approach.clearance;
  out.nearest = approach.where;
}

/// The limits that a motion keeps wholly, without the share that a design leaves free.
MotionLimits full_limits(const ExcitationProblem& problem, const MotionLimits& given, double share) {
  MotionLimits out = problem.limits();
  const VectorXd middle = 0.5 * (out.lower + out.upper), half = 0.5 * (out.upper - out.lower) / share;
  out.lower = middle - half;
  out.upper = middle + half;
  out.speed = given.speed;
  out.acceleration /= share;
  out.torque = given.torque;
  return out;
}

}  // namespace

void ExcitationOptions::validate() const {
  require(duration > 0 && std::isfinite(duration), "duration must be positive [s]");
  require(kind != ExcitationKind::Fourier || harmonics >= 2,
          "harmonics must be at least 2, so that a motion can start at rest");
  require(harmonics <= 50, "harmonics must be at most 50");
  require(min_override > 0 && min_override <= 1, "min_override must be positive and at most 1 [-]");
  require(limit_share > 0 && limit_share <= 1, "limit_share must be positive and at most 1 [-]");
  require(ramp_time > 0 && std::isfinite(ramp_time), "ramp_time must be positive [s]");
  require(torque_noise.size() == 0 || (torque_noise.allFinite() && torque_noise.minCoeff() > 0),
          "torque_noise must be positive [N m or N]");
  require(start.allFinite(), "start must be finite [rad or m]");
  require(std::isfinite(lowest), "lowest must be finite [m]");
  require(points.allFinite(), "points must be finite [m]");
  for (const KeepOut& zone : keep_out) zone.validate();
  require(margin >= 0 && std::isfinite(margin), "margin must not be negative [m]");
  require(link_radii.size() > 0 && link_radii.allFinite() && link_radii.minCoeff() >= 0,
          "link_radii must have at least one value, none of them negative [m]");
  require(starts >= 1, "starts must be at least 1");
  require(exchanges >= 0, "exchanges must not be negative");
}

MotionLimits motion_limits(const cell::Cell& cell) {
  require(cell.robot.limits.has_value(),
          "robot.limits: the cell states none; give lower, upper and velocity of its joints");
  const cell::Limits& stated = *cell.robot.limits;
  const auto n = static_cast<Index>(cell.robot.joints());
  require(stated.lower.size() == n && stated.upper.size() == n, "robot.limits: lower and upper are missing [rad or m]");
  require(stated.velocity.size() == n, "robot.limits: velocity is missing [rad/s or m/s]");
  MotionLimits out{stated.lower, stated.upper, stated.velocity, {}, {}};
  const bool limited = stated.effort.size() == n && stated.effort.array().isFinite().any();
  if (limited) out.torque = stated.effort;
  return out;
}

Eigen::MatrixXd nominal_torques(const cell::Cell& cell, const JointMotion& states) {
  const auto n = static_cast<Index>(cell.robot.joints());
  require(!cell.robot.links.empty(), "robot.links: the cell has no masses, so no torque can be foreseen");
  require(states.q.cols() == n, "states.q: found " + std::to_string(states.q.cols()) +
                                    " columns, expected one a joint: " + std::to_string(n));
  kinematics::Dynamics dynamics = physics::EffectiveArm(cell).dynamics(0.0);
  const Eigen::MatrixXd rotors =
      cell.drives ? physics::Motors(cell).rotor_matrix() : Eigen::MatrixXd(Eigen::MatrixXd::Zero(n, n));
  std::vector<physics::JointFriction> friction;
  for (int j = 0; j < n; ++j) friction.emplace_back(cell, j);
  Eigen::MatrixXd out(states.samples(), n);
  VectorXd tau(n);
  for (Index k = 0; k < states.samples(); ++k) {
    const VectorXd q = states.q.row(k), qd = states.qd.row(k), qdd = states.qdd.row(k);
    dynamics.torques(q, qd, qdd, tau);
    tau += rotors * qdd;
    for (Index j = 0; j < n; ++j)
      out(k, j) =
          tau[j] + physics::joint_friction<double>(friction[static_cast<std::size_t>(j)], {q[j], qd[j], tau[j], 0.0});
  }
  return out;
}

Excitation design_excitation(const cell::Cell& cell, const MotionLimits& limits, const ExcitationOptions& options) {
  options.validate();
  ExcitationProblem problem(cell, limits, options);
  Excitation out;
  out.limits = full_limits(problem, limits, options.limit_share);
  out.base_parameters = static_cast<int>(problem.base_parameters());
  const ExcitationSearch found =
      options.kind == ExcitationKind::Fourier ? search_fourier(problem, options) : search_points(problem, options);
  out.motion = found.motion;
  out.condition_after = found.condition_after;
  out.slowed_strokes = found.slowed_strokes;
  out.fit.iterations = found.exchanges;
  if (found.objection.empty()) {
    measure(out, problem, out.limits);
    out.fit.status = FitStatus::Converged;
    out.fit.message = "best of the motions that were tried";
  } else {
    out.fit.message = "no motion within the limits was found; the obstacle was " + found.objection;
  }
  return out;
}

}  // namespace kr5::identification
