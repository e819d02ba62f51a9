// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/kinematics/newton_euler.hpp>

#include <cmath>
#include <string>

#include <kr5/core/error.hpp>

namespace kr5::kinematics {
namespace {

void require_joints(Eigen::Index size, int joints, const char* what) {
  if (size != joints)
    throw InvalidArgument(std::string(what) + " has " + std::to_string(size) + " values, the chain " +
                          std::to_string(joints) + " joints");
}

}  // namespace

Dynamics::Dynamics(const DhChain& chain, std::span<const Body> bodies, const Eigen::Vector3d& gravity)
    : joints_(chain.joints.size()), links_(chain.joints.size()), R_base_0_(chain.T_base_0.linear()) {
  require_joints(static_cast<Eigen::Index>(bodies.size()), joints(), "bodies");
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    DhJoint row = chain.joints[i];
    const bool revolute = row.type == JointType::Revolute;
    const double theta_offset = row.theta_offset;
    if (revolute) row.theta_offset = 0.0;
    const Pose C = row.transform(0.0);
    const Eigen::Matrix3d R = C.linear();
    joints_[i] = {revolute, theta_offset, R, R.row(2).transpose(), R.transpose() * C.translation()};
    links_[i].body = inertial_moments(bodies[i]);
  }
  set_gravity(gravity);
}

int Dynamics::link_index(int link) const {
  if (link < -1 || link >= joints())
    throw InvalidArgument("no link " + std::to_string(link) + ", the chain has links 0 to " +
                          std::to_string(joints() - 1));
  return link == -1 ? joints() - 1 : link;
}

void Dynamics::set_body(int link, const Body& body) {
  links_[static_cast<std::size_t>(link_index(link))].body = inertial_moments(body);
}

void Dynamics::add_body(int link, const Body& body, const Pose& T_link_body) {
  links_[static_cast<std::size_t>(link_index(link))].body += inertial_moments(transformed_body(T_link_body, body));
}

void Dynamics::set_gravity(const Eigen::Vector3d& gravity) { a_0_ = -(R_base_0_.transpose() * gravity); }

void Dynamics::set_joint(std::size_t i, double q) {
  const Joint& joint = joints_[i];
  Link& link = links_[i];
  if (!joint.revolute) {
    link.R = joint.R;
    link.p = joint.p + joint.z * q;
    return;
  }
  const double theta = joint.theta_offset + q, c = std::cos(theta), s = std::sin(theta);
  link.R.row(0) = c * joint.R.row(0) - s * joint.R.row(1);
  link.R.row(1) = s * joint.R.row(0) + c * joint.R.row(1);
  link.R.row(2) = joint.R.row(2);
  link.p = joint.p;
}

Eigen::Matrix3d Dynamics::acceleration_field(const Eigen::Vector3d& w, const Eigen::Vector3d& wd) {
  const double xx = w.x() * w.x(), yy = w.y() * w.y(), zz = w.z() * w.z();
  const double xy = w.x() * w.y(), xz = w.x() * w.z(), yz = w.y() * w.z();
  Eigen::Matrix3d A;
  A << -yy - zz, xy - wd.z(), xz + wd.y(), xy + wd.z(), -xx - zz, yz - wd.x(), xz - wd.y(), yz + wd.x(), -xx - yy;
  return A;
}

void Dynamics::body_load(const Moments& body, const Motion& m, Eigen::Vector3d& f, Eigen::Vector3d& n) {
  f = body.mass * m.a + acceleration_field(m.w, m.wd) * body.first;
  n = body.second * m.wd + m.w.cross(body.second * m.w) + body.first.cross(m.a);
}

inline void Dynamics::move_link(std::size_t i, const Motion& before, double q, double qd, double qdd) {
  set_joint(i, q);
  const Joint& joint = joints_[i];
  Link& link = links_[i];
  const Eigen::Vector3d w = link.R.transpose() * before.w, slide = joint.z * qd, push = joint.z * qdd;
  Motion now{w, link.R.transpose() * before.wd, link.R.transpose() * before.a};
  if (joint.revolute) {
    now.w += slide;
    now.wd += push + w.cross(slide);
  } else {
    now.a += push + 2.0 * w.cross(slide);
  }
  now.a += acceleration_field(now.w, now.wd) * link.p;
  link.motion = now;
}

void Dynamics::move_links(const double* q, const double* qd, const double* qdd) {
  Motion base;
  base.a = a_0_;
  for (std::size_t i = 0; i < joints_.size(); ++i)
    move_link(i, i == 0 ? base : links_[i - 1].motion, q[i], qd[i], qdd[i]);
}

void Dynamics::forward_pass(const double* q, const double* qd, const double* qdd) {
  move_links(q, qd, qdd);
  for (Link& link : links_) body_load(link.body, link.motion, link.f, link.n);
}

void Dynamics::backward_pass(double* tau, const Vector6* external) {
  Eigen::Vector3d f = Eigen::Vector3d::Zero(), n = Eigen::Vector3d::Zero();
  for (std::size_t i = joints_.size(); i-- > 0;) {
    Link& link = links_[i];
    link.f += f;
    link.n += n;
    if (external) {
      link.f -= external[i].head<3>();
      link.n -= external[i].tail<3>();
    }
    const Eigen::Vector3d about_joint = link.n + link.p.cross(link.f);
    tau[i] = joints_[i].z.dot(joints_[i].revolute ? about_joint : link.f);
    f = link.R * link.f;
    n = link.R * about_joint;
  }
}

void Dynamics::torques(const Eigen::Ref<const Eigen::VectorXd>& q, const Eigen::Ref<const Eigen::VectorXd>& qd,
                       const Eigen::Ref<const Eigen::VectorXd>& qdd, Eigen::Ref<Eigen::VectorXd> tau,
                       std::span<const Vector6> external) {
  require_joints(q.size(), joints(), "q");
  require_joints(qd.size(), joints(), "qd");
  require_joints(qdd.size(), joints(), "qdd");
  require_joints(tau.size(), joints(), "tau");
  if (!external.empty()) require_joints(static_cast<Eigen::Index>(external.size()), joints(), "external");
  forward_pass(q.data(), qd.data(), qdd.data());
  backward_pass(tau.data(), external.empty() ? nullptr : external.data());
}

Eigen::VectorXd Dynamics::torques(const Eigen::VectorXd& q, const Eigen::VectorXd& qd, const Eigen::VectorXd& qdd) {
  Eigen::VectorXd tau(joints());
  torques(q, qd, qdd, tau);
  return tau;
}

Eigen::VectorXd Dynamics::gravity_torques(const Eigen::VectorXd& q) {
  const Eigen::VectorXd still = Eigen::VectorXd::Zero(joints());
  return torques(q, still, still);
}

Vector6 Dynamics::wrench(const SensorCut& cut) const {
  const Link& link = links_[static_cast<std::size_t>(link_index(cut.link))];
  const Eigen::Matrix3d R_sensor_link = cut.T_link_sensor.linear().transpose();
  Motion moving{R_sensor_link * link.motion.w, R_sensor_link * link.motion.wd, link.motion.a};
  moving.a =
      R_sensor_link * (moving.a + acceleration_field(link.motion.w, link.motion.wd) * cut.T_link_sensor.translation());
  Eigen::Vector3d f, n;
  body_load(inertial_moments(cut.body), moving, f, n);
  return (Vector6() << f, n).finished();
}

Vector6 Dynamics::joint_wrench(int link) const {
  const Link& at = links_[static_cast<std::size_t>(link_index(link))];
  return (Vector6() << at.f, at.n).finished();
}

MotionLoads Dynamics::loads(const Eigen::Ref<const Rows>& q, const Eigen::Ref<const Rows>& qd,
                            const Eigen::Ref<const Rows>& qdd, const std::optional<SensorCut>& cut) {
  require_joints(q.cols(), joints(), "a row of q");
  require_joints(qd.cols(), joints(), "a row of qd");
  require_joints(qdd.cols(), joints(), "a row of qdd");
  require(qd.rows() == q.rows() && qdd.rows() == q.rows(), "q, qd and qdd have different numbers of rows");
  MotionLoads out{Rows(q.rows(), q.cols()), Rows(cut ? q.rows() : 0, cut ? 6 : 0)};
  for (Eigen::Index k = 0; k < q.rows(); ++k) {
    forward_pass(q.row(k).data(), qd.row(k).data(), qdd.row(k).data());
    backward_pass(out.tau.row(k).data(), nullptr);
    if (cut) out.wrench.row(k) = wrench(*cut).transpose();
  }
  return out;
}

void Dynamics::composite_bodies(const Eigen::VectorXd& q, Eigen::MatrixXd* whole, Eigen::VectorXd* diagonal) {
  require_joints(q.size(), joints(), "q");
  for (std::size_t i = 0; i < joints_.size(); ++i) set_joint(i, q[static_cast<Eigen::Index>(i)]);
  Moments rest;  // all that lies beyond joint i, about the origin and in the axes of frame i
  for (std::size_t i = joints_.size(); i-- > 0;) {
    const Link& link = links_[i];
    const Joint& joint = joints_[i];
    rest += link.body;
    const Eigen::Matrix3d P = skew(link.p), H = skew(rest.first);
    rest.second -= P * H + H * P + rest.mass * P * P;  // now about the origin of the frame before
    rest.first += rest.mass * link.p;
    // The load of a unit acceleration of this joint, felt by those before it too.
    const Eigen::Vector3d f = joint.revolute ? joint.z.cross(rest.first) : Eigen::Vector3d(rest.mass * joint.z);
    const Eigen::Vector3d n = joint.revolute ? Eigen::Vector3d(rest.second * joint.z) : rest.first.cross(joint.z);
    if (diagonal) (*diagonal)[static_cast<Eigen::Index>(i)] = joint.z.dot(joint.revolute ? n : f);
    if (whole) propagate_unit_load(i, f, n, *whole);
    rest.first = link.R * rest.first;
    rest.second = link.R * rest.second * link.R.transpose();
  }
}

void Dynamics::propagate_unit_load(std::size_t i, Eigen::Vector3d f, Eigen::Vector3d n, Eigen::MatrixXd& M) const {
  const auto column = static_cast<Eigen::Index>(i);
  for (std::size_t j = i;; --j) {
    const auto row = static_cast<Eigen::Index>(j);
    M(row, column) = M(column, row) = joints_[j].z.dot(joints_[j].revolute ? n : f);
    if (j == 0) return;
    f = links_[j].R * f;
    n = links_[j].R * n + links_[j - 1].p.cross(f);
  }
}

Eigen::MatrixXd Dynamics::mass_matrix(const Eigen::VectorXd& q) {
  Eigen::MatrixXd M;
  mass_matrix(q, M);
  return M;
}

void Dynamics::mass_matrix(const Eigen::VectorXd& q, Eigen::MatrixXd& M) {
  M.resize(joints(), joints());
  composite_bodies(q, &M, nullptr);
}

Eigen::VectorXd Dynamics::mass_diagonal(const Eigen::VectorXd& q) {
  Eigen::VectorXd diagonal(joints());
  composite_bodies(q, nullptr, &diagonal);
  return diagonal;
}

}  // namespace kr5::kinematics
