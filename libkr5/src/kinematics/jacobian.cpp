// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/kinematics/jacobian.hpp>

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
