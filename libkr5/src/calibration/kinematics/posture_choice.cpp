// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/posture_choice.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <kr5/core/error.hpp>
#include <kr5/kinematics/jacobian.hpp>

namespace kr5::calibration {
namespace {

/// What one posture tells: derivative of the whitened measurement by the parameters, each over its prior.
Eigen::MatrixXd sensitivity(const kinematics::DhChain& arm, const Eigen::VectorXd& q, const PostureChoiceOptions& o) {
  Pose T;
  const kinematics::Jacobian by_arm = kinematics::parameter_jacobian(arm, q, &T);
  const Eigen::Index joints = by_arm.cols();
  Eigen::MatrixXd by_pose(6, joints + 6);  // right perturbation of T_world_flange by arm and base
  by_pose << by_arm, adjoint(T.inverse());
  for (Eigen::Index k = 0; k < joints; ++k)
    by_pose.col(k) *= k % 5 == 0 || k % 5 == 2 ? o.tolerance_length : o.tolerance_angle;
  constexpr double anywhere = 10.0;  // base and tool may be anywhere [m, rad]
  by_pose.rightCols<6>() *= anywhere;
  if (o.measures_pose) {
    Eigen::MatrixXd out(6, joints + 12);
    out << by_pose, anywhere * Matrix6::Identity();
    out.topRows<3>() /= o.sigma_position;
    out.bottomRows<3>() /= o.sigma_rotation;
    return out;
  }
  Eigen::Matrix<double, 3, 6> by_perturbation;
  by_perturbation << Eigen::Matrix3d::Identity(), -skew(o.point);
  Eigen::MatrixXd out(3, joints + 9);
  out << by_perturbation * by_pose, anywhere * Eigen::Matrix3d::Identity();
  return out / o.sigma_position;
}

/// Derivative of the place of the point, over sigma_position, of what sensitivity() tells.
Eigen::MatrixXd place_of(const Eigen::MatrixXd& sensitivity, const PostureChoiceOptions& o) {
  if (!o.measures_pose) return sensitivity;
  Eigen::Matrix<double, 3, 6> by_pose;
  by_pose << Eigen::Matrix3d::Identity(), -skew(o.point) * (o.sigma_rotation / o.sigma_position);
  return by_pose * sensitivity;
}

/// A set of postures with what it leaves uncertain.
struct Choice {
  const std::vector<Eigen::MatrixXd>& rows;
  const PostureChoiceOptions& options;
  Eigen::MatrixXd weight;       ///< Of the covariance in the criterion: trace(weight covariance).
  Eigen::MatrixXd information;  ///< That of the prior is the identity.
  Eigen::MatrixXd covariance;
  std::vector<bool> taken;

  void set_information(const Eigen::MatrixXd& M) {
    information = M;
    covariance = M.llt().solve(Eigen::MatrixXd::Identity(M.rows(), M.cols()));
  }
  void change(std::size_t i, double sign) {
    taken[i] = sign > 0;
    set_information(information + sign * rows[i].transpose() * rows[i]);
  }
  /// What adding (or with sign -1 taking away) posture i gains.
  double gain(std::size_t i, double sign) const {
    const Eigen::MatrixXd CJ = covariance * rows[i].transpose();
    const Eigen::MatrixXd inner = Eigen::MatrixXd::Identity(rows[i].rows(), rows[i].rows()) + sign * rows[i] * CJ;
    if (options.criterion == PostureCriterion::Determinant) return std::log(std::max(inner.determinant(), 1e-300));
    return sign * (inner.inverse() * (CJ.transpose() * weight * CJ)).trace();
  }
  std::size_t best(double sign) const {
    std::size_t out = rows.size();
    double most = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (taken[i] == (sign > 0)) continue;
      const double value = gain(i, sign);
      if (value > most) most = value, out = i;
    }
    return out;
  }
  double value() const {
    const auto n = static_cast<double>(information.rows());
    if (options.criterion == PostureCriterion::Determinant)
      return 2 * information.llt().matrixLLT().diagonal().array().log().sum() / n;
    const double mean = (weight * covariance).trace();
    return options.criterion == PostureCriterion::Prediction ? options.sigma_position * std::sqrt(mean)
                                                             : std::sqrt(mean / n);
  }
  bool better(double a, double b) const {
    return options.criterion == PostureCriterion::Determinant ? a > b * (1 + 1e-9) + 1e-12 : a < b * (1 - 1e-9);
  }
};

}  // namespace

void PostureChoiceOptions::validate() const {
  require(count >= 1, "count must be at least 1");
  require(sigma_position > 0, "sigma_position must be positive [m]");
  require(sigma_rotation > 0, "sigma_rotation must be positive [rad]");
  require(tolerance_length > 0, "tolerance_length must be positive [m]");
  require(tolerance_angle > 0, "tolerance_angle must be positive [rad]");
  require(point.allFinite(), "point must be finite [m]");
  require(exchanges >= 0, "exchanges must not be negative");
}

PostureChoice choose_postures(const kinematics::DhChain& arm, std::span<const Eigen::VectorXd> candidates,
                              const PostureChoiceOptions& options) {
  options.validate();
  require(static_cast<std::size_t>(options.count) <= candidates.size(),
          "count: found " + std::to_string(options.count) + ", but there are only " +
              std::to_string(candidates.size()) + " candidates");
  std::vector<Eigen::MatrixXd> rows;
  for (const Eigen::VectorXd& q : candidates) {
    require(q.allFinite(), "candidates must be finite [rad or m]");
    rows.push_back(sensitivity(arm, q, options));
  }
  const Eigen::Index n = rows.front().cols();
  Choice choice{rows, options, Eigen::MatrixXd::Identity(n, n), {}, {}, std::vector<bool>(rows.size(), false)};
  if (options.criterion == PostureCriterion::Prediction) {
    choice.weight.setZero();
    for (const Eigen::MatrixXd& row : rows) {
      const Eigen::MatrixXd J = place_of(row, options);
      choice.weight += J.transpose() * J / static_cast<double>(rows.size());
    }
  }
  choice.set_information(Eigen::MatrixXd::Identity(n, n));
  PostureChoice out;
  for (int k = 0; k < options.count; ++k) {
    choice.change(choice.best(+1), +1);
    out.value_after.push_back(choice.value());
  }
  for (int k = 0; k < options.exchanges; ++k) {
    const double before = choice.value();
    const std::size_t leaves = choice.best(-1);
    choice.change(leaves, -1);
    const std::size_t enters = choice.best(+1);
    choice.change(enters, +1);
    if (choice.better(choice.value(), before)) continue;
    choice.change(enters, -1);
    choice.change(leaves, +1);
    break;
  }
  out.value = choice.value();
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (choice.taken[i]) out.chosen.push_back(static_cast<int>(i));
  return out;
}

}  // namespace kr5::calibration
