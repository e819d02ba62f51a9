// SPDX-License-Identifier: BSD-3-Clause
#include "fit/observation.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <kr5/kinematics/jacobian.hpp>

namespace kr5::fit {
namespace {

/// One evaluation: present values and the derivatives that are being summed up.
struct Evaluation {
  const Observation& observation;
  const std::vector<Block>& all;
  const std::vector<const double*>& values;
  double* residuals;
  std::vector<RowMatrix>* jacobians;

  std::size_t place(FitBlock block) const {
    const auto& blocks = observation.blocks;
    return static_cast<std::size_t>(std::find(blocks.begin(), blocks.end(), block.index) - blocks.begin());
  }
  const double* of(FitBlock block) const { return values[place(block)]; }
  const Block& block(FitBlock handle) const { return all[static_cast<std::size_t>(handle.index)]; }
  Eigen::Vector3d point(const FitPoint& p) const {
    return p.block.exists() ? Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(of(p.block))) : p.value;
  }
  /// Whether the derivative by a block is asked for.
  bool wanted(FitBlock handle) const { return jacobians && handle.exists() && (*jacobians)[place(handle)].cols() > 0; }
  template <class Derived>
  void add(FitBlock handle, const Eigen::MatrixBase<Derived>& derivative, int row = 0) const {
    if (wanted(handle)) (*jacobians)[place(handle)].middleRows(row, derivative.rows()) += derivative;
  }
  Eigen::Map<Eigen::VectorXd> out() const { return {residuals, observation.rows}; }
};

/// A factor at the present values: its pose, and how its own parameters perturb it from the right.
struct FactorState {
  Pose T = Pose::Identity();
  kinematics::Jacobian by_block;  // of an arm; of a pose the identity, or what an inverse makes of it
  kinematics::Jacobian by_terms;
};

FactorState arm_state(const Evaluation& e, const PoseChain::Factor& factor) {
  FactorState out;
  const kinematics::DhChain arm = to_arm(e.block(factor.block).chain, e.of(factor.block));
  Eigen::VectorXd q = factor.q;
  const bool terms = factor.joint_terms.exists();
  if (terms)
    q += factor.regressor * Eigen::Map<const Eigen::VectorXd>(e.of(factor.joint_terms), factor.regressor.cols());
  if (!e.wanted(factor.block) && !e.wanted(factor.joint_terms)) {
    out.T = arm.flange(q);
    return out;
  }
  out.by_block = kinematics::parameter_jacobian(arm, q, &out.T);
  if (!terms) return out;
  kinematics::Jacobian by_q(6, q.size());
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    const bool revolute = arm.joints[static_cast<std::size_t>(i)].type == kinematics::JointType::Revolute;
    by_q.col(i) = out.by_block.col(5 * i + (revolute ? 1 : 0));
  }
  out.by_terms = by_q * factor.regressor;
  return out;
}

FactorState factor_state(const Evaluation& e, const PoseChain::Factor& factor) {
  FactorState out;
  if (!factor.block.exists()) {
    out.T = factor.constant;
    return out;
  }
  if (factor.q.size() > 0) {
    out = arm_state(e, factor);
  } else {
    out.T = to_pose_block(e.of(factor.block));
    out.by_block = Matrix6::Identity();
  }
  if (!factor.inverse) return out;
  const Matrix6 across = -adjoint(out.T);  // (T exp(d))^-1 = T^-1 exp(-Ad(T) d)
  if (out.by_block.size()) out.by_block = across * out.by_block;
  if (out.by_terms.size()) out.by_terms = across * out.by_terms;
  out.T = out.T.inverse();
  return out;
}

/// The chain at the present values.
struct ChainState {
  Pose T = Pose::Identity();
  std::vector<FactorState> factors;
};

ChainState chain_state(const Evaluation& e) {
  ChainState out;
  for (const PoseChain::Factor& factor : e.observation.chain.factors()) {
    out.factors.push_back(factor_state(e, factor));
    out.T = out.T * out.factors.back().T;
  }
  return out;
}

/// Carries a derivative by the right perturbation of the whole chain (rows x 6) to the blocks of the chain.
void add_chain(const Evaluation& e, const ChainState& state, const Eigen::Matrix<double, Eigen::Dynamic, 6>& by_chain) {
  if (!e.jacobians) return;
  Pose rest = Pose::Identity();
  const auto& factors = e.observation.chain.factors();
  for (std::size_t k = factors.size(); k-- > 0;) {
    const bool block = e.wanted(factors[k].block), terms = e.wanted(factors[k].joint_terms);
    if (block || terms) {
      const Eigen::Matrix<double, Eigen::Dynamic, 6> here = by_chain * adjoint(rest.inverse());
      if (block) e.add(factors[k].block, here * state.factors[k].by_block);
      if (terms) e.add(factors[k].joint_terms, here * state.factors[k].by_terms);
    }
    rest = state.factors[k].T * rest;
  }
}

/// Derivative of the rotation vector log(R exp(d)) by d, where w = log(R).
Eigen::Matrix3d right_jacobian_inverse(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  const Eigen::Matrix3d W = skew(w);
  double factor = 1.0 / 12.0;
  if (angle > 1e-4) factor = (1 - angle * std::cos(angle / 2) / (2 * std::sin(angle / 2))) / (angle * angle);
  return Eigen::Matrix3d::Identity() + 0.5 * W + factor * W * W;
}

bool pose_residual(const Evaluation& e) {
  const Observation& o = e.observation;
  const ChainState state = chain_state(e);
  const Vector6 d = pose_difference(o.seen, state.T);
  e.out() = o.whitening.cwiseProduct(d);
  Eigen::Matrix<double, Eigen::Dynamic, 6> by_chain = Matrix6::Zero();
  by_chain.topLeftCorner<3, 3>() = o.seen.linear().transpose() * state.T.linear();
  by_chain.bottomRightCorner<3, 3>() = right_jacobian_inverse(d.tail<3>());
  add_chain(e, state, o.whitening.asDiagonal() * by_chain);
  return true;
}

/// Derivative of T p by the right perturbation of T.
Eigen::Matrix<double, 3, 6> point_by_pose(const Pose& T, const Eigen::Vector3d& p) {
  Eigen::Matrix<double, 3, 6> out;
  out << T.linear(), -T.linear() * skew(p);
  return out;
}

bool position_residual(const Evaluation& e) {
  const Observation& o = e.observation;
  const ChainState state = chain_state(e);
  const Eigen::Vector3d p = e.point(o.point);
  e.out() = o.whitening3 * (state.T * p - e.point(o.other));
  if (!e.jacobians) return true;
  add_chain(e, state, o.whitening3 * point_by_pose(state.T, p));
  e.add(o.point.block, o.whitening3 * state.T.linear());
  e.add(o.other.block, -o.whitening3);
  return true;
}

bool distance_residual(const Evaluation& e) {
  const Observation& o = e.observation;
  const ChainState state = chain_state(e);
  const Eigen::Vector3d p = e.point(o.point), between = state.T * p - e.point(o.other);
  const double length = between.norm(), whitening = o.whitening[0];
  const double wanted = o.radius.exists() ? *e.of(o.radius) : o.distance;
  if (!(length > 1e-12)) return false;
  e.residuals[0] = whitening * (length - wanted);
  if (!e.jacobians) return true;
  const Eigen::RowVector3d along = whitening / length * between.transpose();
  add_chain(e, state, along * point_by_pose(state.T, p));
  e.add(o.point.block, along * state.T.linear());
  e.add(o.other.block, -along);
  e.add(o.radius, Eigen::Matrix<double, 1, 1>(-whitening));
  return true;
}

bool plane_residual(const Evaluation& e) {
  const Observation& o = e.observation;
  const ChainState state = chain_state(e);
  const Eigen::Vector3d p = e.point(o.point);
  e.residuals[0] = o.whitening[0] * (state.T * p).z();
  if (!e.jacobians) return true;
  add_chain(e, state, o.whitening[0] * point_by_pose(state.T, p).row(2));
  e.add(o.point.block, o.whitening[0] * state.T.linear().row(2));
  return true;
}

bool plane_points_residual(const Evaluation& e) {
  const Observation& o = e.observation;
  const ChainState state = chain_state(e);
  Eigen::VectorXd height(o.rows);
  Eigen::Matrix<double, Eigen::Dynamic, 6> by_chain(o.rows, 6);
  for (Eigen::Index k = 0; k < o.points.cols(); ++k) {
    height[k] = (state.T * Eigen::Vector3d(o.points.col(k))).z();
    by_chain.row(k) = point_by_pose(state.T, o.points.col(k)).row(2);
  }
  e.out() = o.whitening_matrix * height;
  add_chain(e, state, o.whitening_matrix * by_chain);
  return true;
}

/// With the squares of the radii, so that the sphere may also lie beside the plane while the fit goes on.
bool sphere_section_residual(const Evaluation& e) {
  const Observation& o = e.observation;
  const ChainState state = chain_state(e);
  const Eigen::Vector3d centre = e.point(o.point), c = state.T * centre;
  const double radius = o.radius.exists() ? *e.of(o.radius) : o.distance, seen = o.section[2];
  e.out() = o.whitening3 * Eigen::Vector3d(c.x() - o.section[0], c.z() - o.section[1],
                                           (radius * radius - c.y() * c.y() - seen * seen) / (2 * seen));
  if (!e.jacobians) return true;
  Eigen::Matrix3d by_centre = Eigen::Matrix3d::Zero();
  by_centre(0, 0) = by_centre(1, 2) = 1.0;
  by_centre(2, 1) = -c.y() / seen;
  by_centre = o.whitening3 * by_centre;
  add_chain(e, state, by_centre * point_by_pose(state.T, centre));
  e.add(o.point.block, by_centre * state.T.linear());
  e.add(o.radius, o.whitening3.col(2) * (radius / seen));
  return true;
}

bool pixel_residual(const Evaluation& e) {
  const Observation& o = e.observation;
  const ChainState state = chain_state(e);
  Pinhole camera = e.block(o.camera).camera();
  camera.set_parameters(Eigen::Map<const Pinhole::Parameters>(e.of(o.camera)));
  Eigen::Matrix<double, Eigen::Dynamic, 6> by_chain(o.rows, 6);
  for (Eigen::Index k = 0; k < o.points.cols(); ++k) {
    const Eigen::Vector3d p = state.T * Eigen::Vector3d(o.points.col(k));
    if (!(p.z() > 1e-9)) return false;
    Eigen::Matrix<double, 2, 3> by_point;
    Eigen::Matrix<double, 2, Pinhole::parameter_count> by_camera;
    const Eigen::Vector2d pixel = camera.project(p, &by_point, &by_camera);
    const double whitening = o.whitening[k];
    e.out().segment<2>(2 * k) = whitening * (pixel - o.pixels.col(k));
    if (!e.jacobians) continue;
    by_chain.middleRows<2>(2 * k) = whitening * by_point * point_by_pose(state.T, o.points.col(k));
    e.add(o.camera, whitening * by_camera, static_cast<int>(2 * k));
  }
  if (!e.out().allFinite()) return false;
  add_chain(e, state, by_chain);
  return true;
}

}  // namespace

void Observation::finish(int row_count) {
  rows = row_count;
  const auto use = [&](FitBlock block) {
    if (block.exists() && std::find(blocks.begin(), blocks.end(), block.index) == blocks.end())
      blocks.push_back(block.index);
  };
  for (const PoseChain::Factor& factor : chain.factors()) use(factor.block), use(factor.joint_terms);
  for (const FitBlock block : {point.block, other.block, radius, camera}) use(block);
}

bool Observation::evaluate(const std::vector<Block>& all, const std::vector<const double*>& values, double* residuals,
                           std::vector<RowMatrix>* jacobians) const {
  if (jacobians) {
    jacobians->resize(blocks.size());
    for (std::size_t k = 0; k < blocks.size(); ++k) {
      const Block& block = all[static_cast<std::size_t>(blocks[k])];
      (*jacobians)[k].setZero(rows, block.any_free() ? block.size() : 0);
    }
  }
  const Evaluation e{*this, all, values, residuals, jacobians};
  bool exists = false;
  switch (kind) {
    case ObservationKind::Pose:
      exists = pose_residual(e);
      break;
    case ObservationKind::Position:
      exists = position_residual(e);
      break;
    case ObservationKind::Distance:
      exists = distance_residual(e);
      break;
    case ObservationKind::Plane:
      exists = plane_residual(e);
      break;
    case ObservationKind::PlanePoints:
      exists = plane_points_residual(e);
      break;
    case ObservationKind::SphereSection:
      exists = sphere_section_residual(e);
      break;
    case ObservationKind::Pixels:
      exists = pixel_residual(e);
      break;
  }
  const double scale = std::sqrt(weight);
  if (exists && scale != 1.0) {
    Eigen::Map<Eigen::VectorXd>(residuals, rows) *= scale;
    if (jacobians)
      for (RowMatrix& J : *jacobians) J *= scale;
  }
  return exists;
}

}  // namespace kr5::fit
