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
  const double* const* values;
  double* residuals;
  double* const* jacobians;

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
  bool wanted(FitBlock handle) const { return jacobians && handle.exists() && jacobians[place(handle)] != nullptr; }
  /// Derivative by a block, rows x coordinates; call where it is wanted.
  Eigen::Map<RowMatrix, 0, Eigen::OuterStride<>> by(FitBlock handle) const {
    const Block& b = block(handle);
    return {jacobians[place(handle)], observation.rows, b.size(), Eigen::OuterStride<>(b.values.size())};
  }
  template <class Derived>
  void add(FitBlock handle, const Eigen::MatrixBase<Derived>& derivative) const {
    if (wanted(handle)) by(handle) += derivative;
  }
  Eigen::Map<Eigen::VectorXd> out() const { return {residuals, observation.rows}; }
};

/// A factor at the present values: its pose, and how its own parameters perturb it from the right.
struct FactorState {
  Pose T = Pose::Identity();
  kinematics::Jacobian by_block;  // empty: the identity, of a pose that is not inverse
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
  }
  if (!factor.inverse) return out;
  if (e.jacobians) {
    const Matrix6 across = -adjoint(out.T);  // (T exp(d))^-1 = T^-1 exp(-Ad(T) d)
    if (factor.q.size() == 0) out.by_block = across;
    if (factor.q.size() > 0 && out.by_block.size()) out.by_block = across * out.by_block;
    if (out.by_terms.size()) out.by_terms = across * out.by_terms;
  }
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
    const FactorState& factor = state.factors[k];
    const bool block = e.wanted(factors[k].block), terms = e.wanted(factors[k].joint_terms);
    if (block || terms) {
      const Matrix6 across = adjoint(rest.inverse());
      if (block && factor.by_block.size())
        e.add(factors[k].block, by_chain * (across * factor.by_block));
      else if (block && k + 1 < factors.size())
        e.add(factors[k].block, by_chain * across);
      else if (block)
        e.add(factors[k].block, by_chain);
      if (terms) e.add(factors[k].joint_terms, by_chain * (across * factor.by_terms));
    }
    if (k > 0) rest = factor.T * rest;
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

/// Points of a measurement of pixels, moved by what deforms their target.
Eigen::Matrix3Xd deformed_points(const Evaluation& e) {
  const Observation& o = e.observation;
  if (!o.deformation.amounts.exists()) return o.points;
  const Eigen::MatrixXd& D = o.deformation.displacements;
  const Eigen::VectorXd moved = D * Eigen::Map<const Eigen::VectorXd>(e.of(o.deformation.amounts), D.cols());
  return o.points + moved.reshaped(3, o.points.cols());
}

bool pixel_residual(const Evaluation& e) {
  const Observation& o = e.observation;
  const ChainState state = chain_state(e);
  Pinhole camera;
  camera.set_parameters(Eigen::Map<const Pinhole::Parameters>(e.of(o.camera)));
  const Eigen::Matrix3Xd points = deformed_points(e);
  const bool by_lens = e.wanted(o.camera), by_shape = e.wanted(o.deformation.amounts);
  Eigen::Matrix<double, Eigen::Dynamic, 6> by_chain(e.jacobians ? o.rows : 0, 6);
  Eigen::Matrix<double, 2, 3> P;
  Eigen::Matrix<double, 2, Pinhole::parameter_count> K;
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    const double whitening = o.whitening[k];
    if (whitening == 0.0) {
      e.out().segment<2>(2 * k).setZero();
      if (e.jacobians) by_chain.middleRows<2>(2 * k).setZero();
      continue;
    }
    const Eigen::Vector3d point = points.col(k), seen = state.T * point;
    if (!camera.covers(seen)) return false;
    const Eigen::Vector2d pixel = camera.project(seen, e.jacobians ? &P : nullptr, by_lens ? &K : nullptr);
    e.out().segment<2>(2 * k) = whitening * (pixel - o.pixels.col(k));
    if (!e.jacobians) continue;
    const Eigen::Matrix<double, 2, 3> by_point = whitening * P * state.T.linear();
    by_chain.block<2, 3>(2 * k, 0) = by_point;
    by_chain.block<2, 3>(2 * k, 3) = -by_point * skew(point);
    if (by_lens) e.by(o.camera).middleRows<2>(2 * k) = whitening * K;
    if (by_shape)
      e.by(o.deformation.amounts).middleRows<2>(2 * k) = by_point * o.deformation.displacements.middleRows<3>(3 * k);
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
  for (const FitBlock block : {point.block, other.block, radius, camera, deformation.amounts}) use(block);
}

bool Observation::evaluate(const std::vector<Block>& all, const double* const* values, double* residuals,
                           double* const* jacobians) const {
  const auto stored = [&](std::size_t k) { return rows * all[static_cast<std::size_t>(blocks[k])].values.size(); };
  for (std::size_t k = 0; jacobians && k < blocks.size(); ++k)
    if (jacobians[k]) std::fill_n(jacobians[k], stored(k), 0.0);
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
    for (std::size_t k = 0; jacobians && k < blocks.size(); ++k)
      if (jacobians[k]) Eigen::Map<Eigen::VectorXd>(jacobians[k], stored(k)) *= scale;
  }
  return exists;
}

}  // namespace kr5::fit
