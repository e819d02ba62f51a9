// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/kinematics/dh_chain.hpp>

#include <cmath>
#include <string>

#include <kr5/core/error.hpp>

namespace kr5::kinematics {
namespace {

void require_size(const DhChain& chain, Eigen::Index size) {
  if (size != static_cast<Eigen::Index>(chain.joints.size()))
    throw InvalidArgument("q has " + std::to_string(size) + " values, the chain " +
                          std::to_string(chain.joints.size()) + " joints");
}

}  // namespace

Pose DhJoint::transform(double q) const {
  const bool revolute = type == JointType::Revolute;
  const double theta = theta_offset + (revolute ? q : 0.0), d = b + (revolute ? 0.0 : q);
  const double ct = std::cos(theta), st = std::sin(theta), ca = std::cos(alpha), sa = std::sin(alpha);
  Pose T;
  T.matrix() << ct, -st * ca, st * sa, a * ct, st, ct * ca, -ct * sa, a * st, 0, sa, ca, d, 0, 0, 0, 1;
  if (beta != 0.0) T.linear() *= Eigen::AngleAxisd(beta, Eigen::Vector3d::UnitY()).toRotationMatrix();
  return T;
}

std::vector<Pose> DhChain::link_poses(const Eigen::VectorXd& q) const {
  require_size(*this, q.size());
  std::vector<Pose> poses;
  poses.reserve(joints.size());
  Pose T = T_base_0;
  for (std::size_t i = 0; i < joints.size(); ++i)
    poses.push_back(T = T * joints[i].transform(q[static_cast<Eigen::Index>(i)]));
  return poses;
}

Pose DhChain::flange(const Eigen::VectorXd& q) const {
  require_size(*this, q.size());
  Pose T = T_base_0;
  for (std::size_t i = 0; i < joints.size(); ++i) T = T * joints[i].transform(q[static_cast<Eigen::Index>(i)]);
  return T;
}

Rows DhChain::flanges(const Eigen::Ref<const Rows>& q) const {
  require_size(*this, q.cols());
  Rows out(q.rows(), 16);
  for (Eigen::Index k = 0; k < q.rows(); ++k) {
    Pose T = T_base_0;
    for (std::size_t i = 0; i < joints.size(); ++i) T = T * joints[i].transform(q(k, static_cast<Eigen::Index>(i)));
    Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(out.row(k).data()) = T.matrix();
  }
  return out;
}

}  // namespace kr5::kinematics
