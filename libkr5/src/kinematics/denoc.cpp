// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/kinematics/denoc.hpp>

#include <string>
#include <vector>

#include <kr5/core/error.hpp>

namespace kr5::kinematics {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using WrenchMatrix = Eigen::Matrix<double, 6, inertial_parameter_count>;

/// A link of the chain in motion.
struct DenocLink {
  Matrix6 A;       ///< Twist of this link from that of the one before, its joint locked (4.22).
  Vector6 p;       ///< Twist of this link for a unit rate of its joint (4.23).
  WrenchMatrix V;  ///< (4.20)
};

/// Omega(a) of eq. B.24: I a as a function of Ixx Ixy Ixz Iyy Iyz Izz.
Eigen::Matrix<double, 3, 6> inertia_times(const Eigen::Vector3d& a) {
  Eigen::Matrix<double, 3, 6> out;
  out << a.x(), a.y(), a.z(), 0, 0, 0, 0, a.x(), 0, a.y(), a.z(), 0, 0, 0, a.x(), 0, a.y(), a.z();
  return out;
}

/// Eq. 4.20 with the force first; `a` is the acceleration of the origin less gravity (4.33).
WrenchMatrix wrench_matrix(const Eigen::Vector3d& w, const Eigen::Vector3d& wd, const Eigen::Vector3d& a) {
  WrenchMatrix V = WrenchMatrix::Zero();
  V.topLeftCorner<3, 1>() = a;
  V.block<3, 3>(0, 1) = skew(wd) + skew(w) * skew(w);
  V.block<3, 3>(3, 1) = -skew(a);
  V.bottomRightCorner<3, 6>() = inertia_times(wd) + skew(w) * inertia_times(w);
  return V;
}

std::vector<DenocLink> denoc_links(const DhChain& chain, const Eigen::VectorXd& q, const Eigen::VectorXd& qd,
                                   const Eigen::VectorXd& qdd, const Eigen::Vector3d& gravity) {
  const auto n = static_cast<Eigen::Index>(chain.joints.size());
  require(q.size() == n && qd.size() == n && qdd.size() == n,
          "q, qd, qdd: expected " + std::to_string(n) + " values each, one a joint");
  std::vector<DenocLink> links;
  Vector6 twist = Vector6::Zero(), rate = Vector6::Zero();  // `rate`: acceleration of the origin, of the angle
  rate.head<3>() = -(chain.T_base_0.linear().transpose() * gravity);
  for (Eigen::Index i = 0; i < n; ++i) {
    const DhJoint& joint = chain.joints[static_cast<std::size_t>(i)];
    const Pose T = joint.transform(q[i]);
    const Eigen::Matrix3d R = T.linear().transpose();
    const Eigen::Vector3d z = R.col(2), r = R * T.translation();
    DenocLink link{Matrix6::Zero(), Vector6::Zero(), {}};
    link.A.topLeftCorner<3, 3>() = link.A.bottomRightCorner<3, 3>() = R;
    link.A.topRightCorner<3, 3>() = -skew(r) * R;
    if (joint.type == JointType::Revolute)
      link.p << z.cross(r), z;
    else
      link.p << z, Eigen::Vector3d::Zero();
    const Eigen::Vector3d w_before = R * twist.tail<3>();
    twist = link.A * twist + link.p * qd[i];
    rate = link.A * rate + link.p * qdd[i];
    // What is left of the derivatives of A and p: r and z turn with the link, or with the one before it.
    const Eigen::Vector3d w = twist.tail<3>(), slide = z * qd[i];
    if (joint.type == JointType::Revolute) {
      const Eigen::Vector3d turn = w_before.cross(slide);
      rate.tail<3>() += turn;
      rate.head<3>() += turn.cross(r) + w.cross(w.cross(r));
    } else {
      rate.head<3>() += w.cross(w.cross(r)) + 2.0 * w.cross(slide);
    }
    link.V = wrench_matrix(w, rate.tail<3>(), rate.head<3>());
    links.push_back(link);
  }
  return links;
}

}  // namespace

Denoc denoc(const DhChain& chain, const Eigen::VectorXd& q, const Eigen::VectorXd& qd, const Eigen::VectorXd& qdd,
            const Eigen::Vector3d& gravity) {
  const std::vector<DenocLink> links = denoc_links(chain, q, qd, qdd, gravity);
  const auto n = static_cast<Eigen::Index>(links.size());
  Denoc out{Eigen::MatrixXd::Identity(6 * n, 6 * n), Eigen::MatrixXd::Zero(6 * n, n),
            Eigen::MatrixXd::Zero(6 * n, inertial_parameter_count * n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const DenocLink& link = links[static_cast<std::size_t>(i)];
    out.N_d.block<6, 1>(6 * i, i) = link.p;
    out.V.block<6, inertial_parameter_count>(6 * i, inertial_parameter_count * i) = link.V;
    if (i > 0)
      out.N_l.middleRows<6>(6 * i).leftCols(6 * i) = link.A * out.N_l.middleRows<6>(6 * (i - 1)).leftCols(6 * i);
  }
  return out;
}

Eigen::VectorXd denoc_torques(const DhChain& chain, std::span<const Body> bodies, const Eigen::VectorXd& q,
                              const Eigen::VectorXd& qd, const Eigen::VectorXd& qdd, const Eigen::Vector3d& gravity) {
  require(bodies.size() == chain.joints.size(), "bodies: expected " + std::to_string(chain.joints.size()) +
                                                    ", one a joint, found " + std::to_string(bodies.size()));
  const std::vector<DenocLink> links = denoc_links(chain, q, qd, qdd, gravity);
  Eigen::VectorXd tau(q.size());
  Vector6 wrench = Vector6::Zero();  // N_l^T V chi: the wrench of all links from this one outwards
  for (std::size_t i = links.size(); i-- > 0;) {
    wrench += links[i].V * inertial_parameters(bodies[i]);
    tau[static_cast<Eigen::Index>(i)] = links[i].p.dot(wrench);
    wrench = links[i].A.transpose() * wrench;
  }
  return tau;
}

}  // namespace kr5::kinematics
