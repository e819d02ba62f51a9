// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/kinematics/inertial_regressor.hpp>

#include <string>

#include <kr5/core/error.hpp>

namespace kr5::kinematics {
namespace {

void require_regressor_size(Eigen::Index size, Eigen::Index expected, const char* what) {
  if (size != expected)
    throw InvalidArgument(std::string(what) + ": expected " + std::to_string(expected) + " values, found " +
                          std::to_string(size));
}

}  // namespace

InertialParameters inertial_parameters(const Moments& m) {
  const Eigen::Matrix3d& I = m.second;
  return (InertialParameters() << m.mass, m.first, I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2)).finished();
}

InertialParameters inertial_parameters(const Body& body) { return inertial_parameters(inertial_moments(body)); }

Moments to_moments(const InertialParameters& p) {
  Moments out{p[0], p.segment<3>(1), Eigen::Matrix3d()};
  out.second << p[4], p[5], p[6], p[5], p[7], p[8], p[6], p[8], p[9];
  return out;
}

InertialRegressor::InertialRegressor(const DhChain& chain, const Eigen::Vector3d& gravity)
    : arm_(chain, std::vector<Body>(chain.joints.size()), gravity), twists_(chain.joints.size()) {}

void InertialRegressor::write(const double* q, const double* qd, const double* qdd, double* out, Eigen::Index row_step,
                              Eigen::Index column_step) {
  arm_.move_links(q, qd, qdd);
  const std::size_t n = twists_.size();
  for (std::size_t j = 0; j < n; ++j) {
    const Dynamics::Link& link = arm_.links_[j];
    const Dynamics::Joint& joint = arm_.joints_[j];
    // Copies, which what is written cannot be part of: so they stay in registers.
    const auto [w, wd, a] = link.motion;
    const Eigen::Matrix3d A = Dynamics::acceleration_field(w, wd).transpose(), R = link.R.transpose();
    const Eigen::Vector3d p = link.p;
    if (joint.revolute)
      twists_[j] = {joint.z.cross(link.p), joint.z};
    else
      twists_[j] = {joint.z, Eigen::Vector3d::Zero()};
    double* column = out + static_cast<Eigen::Index>(inertial_parameter_count * j) * column_step;
    for (std::size_t i = 0; i <= j; ++i) {
      UnitTwist at = twists_[i];
      if (i < j) {  // from the frame before to this one
        at.w = (R * at.w).eval();
        at.v = (R * at.v).eval() + at.w.cross(p);
        twists_[i] = at;
      }
      // Power of the load m a + A (m c), I wd + w x I w + (m c) x a of the link (eq. 4.19) under the unit twist.
      const Eigen::Vector3d& s = at.w;
      const Eigen::Vector3d u = s.cross(w), first = A * at.v + a.cross(s);
      double* e = column + static_cast<Eigen::Index>(i) * row_step;
      e[0] = at.v.dot(a);
      e[column_step] = first.x();
      e[2 * column_step] = first.y();
      e[3 * column_step] = first.z();
      e[4 * column_step] = s.x() * wd.x() + u.x() * w.x();
      e[5 * column_step] = s.x() * wd.y() + s.y() * wd.x() + u.x() * w.y() + u.y() * w.x();
      e[6 * column_step] = s.x() * wd.z() + s.z() * wd.x() + u.x() * w.z() + u.z() * w.x();
      e[7 * column_step] = s.y() * wd.y() + u.y() * w.y();
      e[8 * column_step] = s.y() * wd.z() + s.z() * wd.y() + u.y() * w.z() + u.z() * w.y();
      e[9 * column_step] = s.z() * wd.z() + u.z() * w.z();
    }
  }
}

void InertialRegressor::evaluate(const Eigen::Ref<const Eigen::VectorXd>& q,
                                 const Eigen::Ref<const Eigen::VectorXd>& qd,
                                 const Eigen::Ref<const Eigen::VectorXd>& qdd, Eigen::Ref<Eigen::MatrixXd> Y) {
  require_regressor_size(q.size(), joints(), "q");
  require_regressor_size(qd.size(), joints(), "qd");
  require_regressor_size(qdd.size(), joints(), "qdd");
  require_regressor_size(Y.rows(), joints(), "a column of Y");
  require_regressor_size(Y.cols(), parameters(), "a row of Y");
  Y.setZero();
  write(q.data(), qd.data(), qdd.data(), Y.data(), 1, Y.outerStride());
}

Rows InertialRegressor::evaluate(const Eigen::Ref<const Rows>& q, const Eigen::Ref<const Rows>& qd,
                                 const Eigen::Ref<const Rows>& qdd) {
  require_regressor_size(q.cols(), joints(), "a row of q");
  require_regressor_size(qd.cols(), joints(), "a row of qd");
  require_regressor_size(qdd.cols(), joints(), "a row of qdd");
  require_regressor_size(qd.rows(), q.rows(), "a column of qd");
  require_regressor_size(qdd.rows(), q.rows(), "a column of qdd");
  Rows Y = Rows::Zero(q.rows() * joints(), parameters());
  for (Eigen::Index k = 0; k < q.rows(); ++k)
    write(q.row(k).data(), qd.row(k).data(), qdd.row(k).data(), Y.row(k * joints()).data(), Y.outerStride(), 1);
  return Y;
}

}  // namespace kr5::kinematics
