// SPDX-License-Identifier: BSD-3-Clause
#include "fit/observation.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Dense>
#include <kr5/geometry/pose_derivatives.hpp>
#include <kr5/kinematics/jacobian.hpp>

namespace kr5::fit {
namespace {

/// One evaluation: present values and the derivatives that are being summed up.
struct Evaluation {
  const Observation& observation;
  const std::vector<Block>& all;
  const std::vector<const double*>& values;
  int rows;
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
  Eigen::Map<Eigen::VectorXd> out() const { return {residuals, rows}; }
};

/// A factor at the present values: its pose, and how its own parameters perturb it from the right.
struct FactorState {
  Pose T = Pose::Identity();
  kinematics::Jacobian by_block;  // where it is wanted; of a pose the identity, or what an inverse makes of it
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

/// Empty where the path has no pose.
std::optional<FactorState> path_state(const Evaluation& e, const PoseChain::Factor& factor) {
  const double delay = factor.block.exists() ? *e.of(factor.block) : 0.0;
  const std::optional<PathSample> sample = factor.path(factor.t - delay);
  if (!sample) return std::nullopt;
  FactorState out;
  out.T = sample->T;
  if (e.wanted(factor.block)) out.by_block = -sample->rate;
  return out;
}

std::optional<FactorState> factor_state(const Evaluation& e, const PoseChain::Factor& factor) {
  FactorState out;
  if (factor.path) {
    const auto on_path = path_state(e, factor);
    if (!on_path) return std::nullopt;
    out = *on_path;
  } else if (!factor.block.exists()) {
    out.T = factor.constant;
    return out;
  } else if (factor.q.size() > 0) {
    out = arm_state(e, factor);
  } else {
    out.T = to_pose_block(e.of(factor.block));
    if (e.wanted(factor.block)) out.by_block = Matrix6::Identity();
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

/// Empty where a path has no pose.
std::optional<ChainState> chain_state(const Evaluation& e) {
  ChainState out;
  out.factors.reserve(e.observation.chain.factors().size());
  for (const PoseChain::Factor& factor : e.observation.chain.factors()) {
    const auto state = factor_state(e, factor);
    if (!state) return std::nullopt;
    out.T = out.T * state->T;
    out.factors.push_back(*state);
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

bool pose_residual(const Evaluation& e, const ChainState& state) {
  const Observation& o = e.observation;
  const Vector6 d = pose_difference(o.seen, state.T);
  e.out() = o.whitening6 * d;
  if (e.jacobians) add_chain(e, state, o.whitening6 * vector_by_perturbation(d));
  return true;
}

/// Derivative of T p by the right perturbation of T.
Eigen::Matrix<double, 3, 6> point_by_pose(const Pose& T, const Eigen::Vector3d& p) {
  Eigen::Matrix<double, 3, 6> out;
  out << T.linear(), -T.linear() * skew(p);
  return out;
}

bool position_residual(const Evaluation& e, const ChainState& state) {
  const Observation& o = e.observation;
  const Eigen::Vector3d p = e.point(o.point);
  e.out() = o.whitening3 * (state.T * p - e.point(o.other));
  if (!e.jacobians) return true;
  add_chain(e, state, o.whitening3 * point_by_pose(state.T, p));
  e.add(o.point.block, o.whitening3 * state.T.linear());
  e.add(o.other.block, -o.whitening3);
  return true;
}

bool distance_residual(const Evaluation& e, const ChainState& state) {
  const Observation& o = e.observation;
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

bool plane_residual(const Evaluation& e, const ChainState& state) {
  const Observation& o = e.observation;
  const Eigen::Vector3d p = e.point(o.point);
  e.residuals[0] = o.whitening[0] * (state.T * p).z();
  if (!e.jacobians) return true;
  add_chain(e, state, o.whitening[0] * point_by_pose(state.T, p).row(2));
  e.add(o.point.block, o.whitening[0] * state.T.linear().row(2));
  return true;
}

bool plane_points_residual(const Evaluation& e, const ChainState& state) {
  const Observation& o = e.observation;
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
bool sphere_section_residual(const Evaluation& e, const ChainState& state) {
  const Observation& o = e.observation;
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

Pinhole camera_at(const Evaluation& e) {
  Pinhole camera = e.block(e.observation.camera).camera();
  camera.set_parameters(Eigen::Map<const Pinhole::Parameters>(e.of(e.observation.camera)));
  return camera;
}

using PixelByCamera = Eigen::Matrix<double, 2, Pinhole::parameter_count>;

/// Residual of one pixel, over its standard deviation; empty behind the camera. Derivatives where they are wanted, that
/// by the right perturbation of the target.
std::optional<Eigen::Vector2d> pixel_of(const Evaluation& e, const Pinhole& camera, const Pose& T, Eigen::Index k,
                                        Eigen::Matrix<double, 2, 6>* by_chain, PixelByCamera* by_camera) {
  const Observation& o = e.observation;
  const Eigen::Vector3d on_target = o.points.col(k), p = T * on_target;
  if (!(p.z() > 1e-9)) return std::nullopt;
  Eigen::Matrix<double, 2, 3> by_point;
  const double whitening = o.whitening[k];
  const Eigen::Vector2d r =
      whitening * (camera.project(p, by_chain ? &by_point : nullptr, by_camera) - o.pixels.col(k));
  if (by_chain) {
    by_chain->leftCols<3>() = whitening * by_point * T.linear();
    by_chain->rightCols<3>() = -by_chain->leftCols<3>() * skew(on_target);
  }
  if (by_camera) *by_camera *= whitening;
  return r;
}

bool pixel_residual(const Evaluation& e, const ChainState& state) {
  const Pinhole camera = camera_at(e);
  const bool camera_wanted = e.wanted(e.observation.camera);
  Eigen::Matrix<double, Eigen::Dynamic, 6> by_chain(e.jacobians ? e.rows : 0, 6);
  Eigen::Matrix<double, 2, 6> by_pose;
  PixelByCamera by_camera;
  for (Eigen::Index k = 0; k < e.observation.points.cols(); ++k) {
    const auto r =
        pixel_of(e, camera, state.T, k, e.jacobians ? &by_pose : nullptr, camera_wanted ? &by_camera : nullptr);
    if (!r) return false;
    e.out().segment<2>(2 * k) = *r;
    if (e.jacobians) by_chain.middleRows<2>(2 * k) = by_pose;
    if (camera_wanted) e.add(e.observation.camera, by_camera, static_cast<int>(2 * k));
  }
  if (!e.out().allFinite()) return false;
  add_chain(e, state, by_chain);
  return true;
}

constexpr int rows_of_pose = 7;  // six that hang on it, and what is left

/// The pixels of a known camera by seven rows: with H = J' J = M' M and g = J' r, the rows M d + M^-T g have the
/// information H, the gradient g and, with a last row that does not depend on d, the squares of r.
bool few_pixel_residuals(const Evaluation& e, const ChainState& state) {
  const Pinhole camera = camera_at(e);
  Matrix6 H = Matrix6::Zero();
  Vector6 g = Vector6::Zero();
  double squares = 0.0;
  Eigen::Matrix<double, 2, 6> J;
  for (Eigen::Index k = 0; k < e.observation.points.cols(); ++k) {
    const auto r = pixel_of(e, camera, state.T, k, e.jacobians ? &J : nullptr, nullptr);
    if (!r) return false;
    squares += r->squaredNorm();
    if (!e.jacobians) continue;
    H.noalias() += J.transpose() * J;
    g.noalias() += J.transpose() * *r;
  }
  if (!std::isfinite(squares)) return false;
  e.out().setZero();
  e.out()[rows_of_pose - 1] = std::sqrt(squares);
  if (!e.jacobians) return true;
  const Eigen::LDLT<Matrix6> factors(H);  // P' L D L' P, where rounding or points on a line leave D without its last
  const auto P = factors.transpositionsP();
  const Matrix6 L = factors.matrixL();
  const Vector6 along = factors.matrixL().solve(Vector6(P * g));
  const Vector6 own = P * Vector6(H.diagonal());
  Eigen::Matrix<double, Eigen::Dynamic, 6> by_chain = Eigen::Matrix<double, Eigen::Dynamic, 6>::Zero(rows_of_pose, 6);
  for (Eigen::Index k = 0; k < 6; ++k) {
    const double d = factors.vectorD()[k];
    if (!(d > 1e-14 * own[k])) continue;
    by_chain.row(k) = std::sqrt(d) * (P.transpose() * L.col(k)).transpose();
    e.out()[k] = along[k] / std::sqrt(d);
  }
  e.out()[rows_of_pose - 1] = std::sqrt(std::max(0.0, squares - e.out().head<6>().squaredNorm()));
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

int Observation::few_rows(const std::vector<Block>& all) const {
  const bool one_pose = kind == ObservationKind::Pixels && !all[static_cast<std::size_t>(camera.index)].any_free();
  return one_pose ? std::min(rows, rows_of_pose) : rows;
}

bool Observation::evaluate(const std::vector<Block>& all, const std::vector<const double*>& values, double weight,
                           double* residuals, std::vector<RowMatrix>* jacobians) const {
  return evaluate_rows(rows, all, values, weight, residuals, jacobians);
}

bool Observation::evaluate_few(const std::vector<Block>& all, const std::vector<const double*>& values, double weight,
                               double* residuals, std::vector<RowMatrix>* jacobians) const {
  return evaluate_rows(few_rows(all), all, values, weight, residuals, jacobians);
}

bool Observation::evaluate_rows(int row_count, const std::vector<Block>& all, const std::vector<const double*>& values,
                                double weight, double* residuals, std::vector<RowMatrix>* jacobians) const {
  if (jacobians) {
    jacobians->resize(blocks.size());
    for (std::size_t k = 0; k < blocks.size(); ++k) {
      const Block& block = all[static_cast<std::size_t>(blocks[k])];
      (*jacobians)[k].setZero(row_count, block.any_free() ? block.size() : 0);
    }
  }
  const Evaluation e{*this, all, values, row_count, residuals, jacobians};
  const std::optional<ChainState> state = chain_state(e);
  if (!state) return false;
  bool exists = false;
  switch (kind) {
    case ObservationKind::Pose:
      exists = pose_residual(e, *state);
      break;
    case ObservationKind::Position:
      exists = position_residual(e, *state);
      break;
    case ObservationKind::Distance:
      exists = distance_residual(e, *state);
      break;
    case ObservationKind::Plane:
      exists = plane_residual(e, *state);
      break;
    case ObservationKind::PlanePoints:
      exists = plane_points_residual(e, *state);
      break;
    case ObservationKind::SphereSection:
      exists = sphere_section_residual(e, *state);
      break;
    case ObservationKind::Pixels:
      exists = row_count < rows ? few_pixel_residuals(e, *state) : pixel_residual(e, *state);
      break;
  }
  const double scale = std::sqrt(weight);
  if (exists && scale != 1.0) {
    Eigen::Map<Eigen::VectorXd>(residuals, row_count) *= scale;
    if (jacobians)
      for (RowMatrix& J : *jacobians) J *= scale;
  }
  return exists;
}

}  // namespace kr5::fit
