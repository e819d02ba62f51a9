// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/kinematics/jacobian.hpp>

#include <cmath>
#include <limits>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>

namespace kr5::kinematics {

Jacobian jacobian(const DhChain& chain, const Eigen::VectorXd& q, const Pose& T_flange_x) {
  const std::vector<Pose> T = chain.link_poses(q);
  Jacobian J(6, q.size());
  if (T.empty()) return J;
  const Eigen::Vector3d x = T.back() * T_flange_x.translation();
  for (std::size_t i = 0; i < T.size(); ++i) {
    const Pose& before = i == 0 ? chain.T_base_0 : T[i - 1];
    const Eigen::Vector3d z = before.linear().col(2), arm = x - before.translation();
    const auto column = static_cast<Eigen::Index>(i);
    if (chain.joints[i].type == JointType::Revolute)
      J.col(column) << z.cross(arm), z;
    else
      J.col(column) << z, Eigen::Vector3d::Zero();
  }
  return J;
}

Jacobian parameter_jacobian(const DhChain& chain, const Eigen::VectorXd& q, Pose* T_base_flange) {
  const std::vector<Pose> T = chain.link_poses(q);
  Jacobian J(6, 5 * q.size());
  const Pose end = T.empty() ? chain.T_base_0 : T.back();
  if (T_base_flange) *T_base_flange = end;
  const Eigen::Matrix3d to_end = end.linear().transpose();
  // A turn about an axis through a point, and a shift, both in base axes, as seen by the flange.
  const auto turn = [&](const Eigen::Vector3d& axis, const Eigen::Vector3d& through) {
    Vector6 d;
    d << to_end * axis.cross(end.translation() - through), to_end * axis;
    return d;
  };
  const auto shift = [&](const Eigen::Vector3d& axis) {
    Vector6 d;
    d << to_end * axis, Eigen::Vector3d::Zero();
    return d;
  };
  for (std::size_t i = 0; i < T.size(); ++i) {
    const Pose& before = i == 0 ? chain.T_base_0 : T[i - 1];
    const Eigen::Vector3d z = before.linear().col(2), y = T[i].linear().col(1);
    // x of the turned joint frame: the last link frame without its turn beta about y.
    const double beta = chain.joints[i].beta;
    const Eigen::Vector3d x = std::cos(beta) * T[i].linear().col(0) + std::sin(beta) * T[i].linear().col(2);
    const auto column = static_cast<Eigen::Index>(5 * i);
    J.col(column) = shift(z);
    J.col(column + 1) = turn(z, before.translation());
    J.col(column + 2) = shift(x);
    J.col(column + 3) = turn(x, T[i].translation());
    J.col(column + 4) = turn(y, T[i].translation());
  }
  return J;
}

Manipulability manipulability(const Jacobian& J, double length) {
  require(length > 0.0, "length must be positive");
  Jacobian scaled = J;
  scaled.topRows<3>() /= length;
  Manipulability out;
  out.singular_values = kr5::singular_values(scaled);
  out.volume = out.singular_values.prod();
  const double least = out.singular_values.size() ? out.singular_values.tail<1>()[0] : 0.0;
  out.condition = least > 0.0 ? out.singular_values[0] / least : std::numeric_limits<double>::infinity();
  return out;
}

std::vector<int> outside_limits(const Eigen::VectorXd& q, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
                                double tolerance) {
  require(q.size() == lower.size() && q.size() == upper.size(),
          "q has " + std::to_string(q.size()) + " values, the limits " + std::to_string(lower.size()) + " and " +
              std::to_string(upper.size()));
  std::vector<int> outside;
  for (Eigen::Index i = 0; i < q.size(); ++i)
    if (q[i] < lower[i] - tolerance || q[i] > upper[i] + tolerance) outside.push_back(static_cast<int>(i));
  return outside;
}

}  // namespace kr5::kinematics
