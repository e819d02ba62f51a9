// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/current_limits.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/kinematics/jacobian.hpp>
#include <kr5/uncertainty/confidence.hpp>

namespace kr5::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double unlimited = std::numeric_limits<double>::infinity();
constexpr double min_current_share = 1e-9;  // of the greatest current per force: less is rounding

/// What motors need in one posture.
struct PostureNeed {
  VectorXd holding;      // [A], signed
  VectorXd uncertainty;  // [A]
  MatrixXd per_force;    // motors x directions [A/N]
};

std::vector<PostureNeed> needs_of(const GravityModel& model, const MatrixXd& current_per_torque,
                                  const Eigen::Ref<const MatrixXd>& postures, const PassiveLimitOptions& options,
                                  FitReport& fit) {
  const double factor = uncertainty::normal_factor(options.confidence);
  std::vector<PostureNeed> out;
  for (Index k = 0; k < postures.rows(); ++k) {
    const VectorXd q = postures.row(k).transpose();
    const GravityPrediction gravity = model.predict(q);
    for (Index j = 0; j < gravity.sigma.size(); ++j)
      if (!std::isfinite(gravity.sigma[j])) {
        fit.message = "posture " + std::to_string(k) + ": the gravity torque of joint " + std::to_string(j + 1) +
                      " is not determined by the motion from which the model was identified";
        return {};
      }
    const kinematics::Jacobian J = kinematics::jacobian(model.chain, q, options.T_flange_tool);
    out.push_back({current_per_torque * gravity.tau, factor * (current_per_torque.cwiseAbs() * gravity.sigma),
                   current_per_torque * J.topRows<3>().transpose() * options.directions});
  }
  return out;
}

/// Force at which current `reserve` beyond (or short of) the holding current is taken up.
double force_at(double reserve, double per_force) { return std::max(0.0, reserve) / std::abs(per_force); }

/// Forces of one posture, in all directions.
void find_forces(PassiveLimits& out, Index k, const PostureNeed& need) {
  const double least = min_current_share * need.per_force.cwiseAbs().maxCoeff();
  for (Index c = 0; c < need.per_force.cols(); ++c) {
    out.yield_force(k, c) = out.push_force(k, c) = unlimited;
    out.yield_motor(k, c) = -1;
    for (Index m = 0; m < need.per_force.rows(); ++m) {
      const double d = need.per_force(m, c);
      if (std::abs(d) <= least) continue;
      const double helped = d > 0 ? need.holding[m] : -need.holding[m];
      const double yields = force_at(out.limit[m] + out.friction[m] + helped, d);
      if (yields < out.yield_force(k, c)) out.yield_force(k, c) = yields, out.yield_motor(k, c) = static_cast<int>(m);
      out.push_force(k, c) = std::min(out.push_force(k, c), force_at(out.limit[m] - out.friction[m] - helped, d));
    }
  }
}

/// Greatest margin with which motor m has a limit of at most `current` in all postures.
double margin_for(const std::vector<PostureNeed>& needs, const VectorXd& friction, Index m, double current,
                  double min_limit) {
  if (current < min_limit) return -unlimited;
  double out = unlimited;
  for (const PostureNeed& need : needs)
    out = std::min(out, (current - need.uncertainty[m]) / (std::abs(need.holding[m]) + friction[m]) - 1.0);
  return out;
}

double max_margin(const std::vector<PostureNeed>& needs, const VectorXd& friction, const PassiveLimitOptions& options) {
  double out = unlimited;
  for (const PostureNeed& need : needs)
    for (Index c = 0; c < need.per_force.cols(); ++c) {
      double best = -unlimited;  // one motor that gives way is enough
      for (Index m = 0; m < need.per_force.rows(); ++m) {
        const double d = need.per_force(m, c), helped = d > 0 ? need.holding[m] : -need.holding[m];
        const double current = options.contact_force * std::abs(d) - friction[m] - helped;
        best = std::max(best, margin_for(needs, friction, m, current, options.min_limit));
      }
      out = std::min(out, best);
    }
  return out;
}

void check_limit_inputs(const GravityModel& model, const VectorXd& coulomb, const physics::Motors& motors,
                        const Eigen::Ref<const MatrixXd>& postures) {
  const auto n = static_cast<Index>(model.chain.joints.size());
  const std::string expected = ", expected one a joint: " + std::to_string(n);
  require(coulomb.size() == n, "coulomb: found " + std::to_string(coulomb.size()) + " values" + expected);
  require(coulomb.allFinite() && (coulomb.array() >= 0).all(), "coulomb must not be negative [N m or N]");
  require(motors.torque_constant.size() == n,
          "motors: found " + std::to_string(motors.torque_constant.size()) + expected);
  require(postures.rows() > 0, "postures: none is given");
  require(postures.cols() == n, "postures: found " + std::to_string(postures.cols()) + " columns" + expected);
  require(postures.allFinite(), "postures must be finite [rad or m]");
}

}  // namespace

Eigen::Matrix3Xd PassiveLimitOptions::default_directions() {
  Eigen::Matrix3Xd out(3, 6);
  out << Eigen::Matrix3d::Identity(), -Eigen::Matrix3d::Identity();
  return out;
}

void PassiveLimitOptions::validate() const {
  force::CurrentLimitOptions{margin, min_limit}.validate();
  require(confidence > 0 && confidence < 1, "confidence must be between 0 and 1 [-]");
  require(directions.cols() > 0, "directions: none is given");
  require(((directions.colwise().norm().array() - 1).abs() < 1e-6).all(), "directions must be unit vectors");
  require(contact_force >= 0 && std::isfinite(contact_force), "contact_force must not be negative [N]");
}

PassiveLimits passive_limits(const GravityModel& model, const VectorXd& coulomb, const physics::Motors& motors,
                             const Eigen::Ref<const MatrixXd>& postures, const PassiveLimitOptions& options) {
  options.validate();
  check_limit_inputs(model, coulomb, motors, postures);
  const Index n = coulomb.size();
  const MatrixXd current_per_torque = motors.torque_constant.cwiseInverse().asDiagonal() * motors.inverse.transpose();
  PassiveLimits out;
  const std::vector<PostureNeed> needs = needs_of(model, current_per_torque, postures, options, out.fit);
  if (needs.empty()) return out;
  out.friction = current_per_torque.cwiseAbs() * coulomb;  // whichever way the joints move
  out.limit = VectorXd::Constant(n, -unlimited);
  out.holding = out.uncertainty = VectorXd::Zero(n);
  out.posture.assign(static_cast<std::size_t>(n), 0);
  for (std::size_t k = 0; k < needs.size(); ++k) {
    const VectorXd needed = force::current_limits(needs[k].holding, out.friction, {options.margin, options.min_limit}) +
                            needs[k].uncertainty;
    for (Index m = 0; m < n; ++m) {
      if (needed[m] <= out.limit[m]) continue;
      out.limit[m] = needed[m];
      out.holding[m] = needs[k].holding[m];
      out.uncertainty[m] = needs[k].uncertainty[m];
      out.posture[static_cast<std::size_t>(m)] = static_cast<int>(k);
    }
  }
  const auto rows = static_cast<Index>(needs.size());
  out.yield_force.resize(rows, options.directions.cols());
  out.yield_motor.resize(rows, options.directions.cols());
  out.push_force.resize(rows, options.directions.cols());
  for (Index k = 0; k < rows; ++k) find_forces(out, k, needs[static_cast<std::size_t>(k)]);
  out.max_margin = options.contact_force > 0 ? max_margin(needs, out.friction, options) : unlimited;
  out.fit = {FitStatus::Converged, 0, 0.0, 0.0, "limits of " + std::to_string(rows) + " postures"};
  return out;
}

}  // namespace kr5::identification
