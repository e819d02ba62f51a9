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
  const double* const* values;
  int rows;
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
    return {jacobians[place(handle)], rows, b.size(), Eigen::OuterStride<>(b.values.size())};
  }
  template <class Derived>
  void add(FitBlock handle, const Eigen::MatrixBase<Derived>& derivative) const {
    if (wanted(handle)) by(handle) += derivative;
  }
  Eigen::Map<Eigen::VectorXd> out() const { return {residuals, rows}; }
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

/// Points of a measurement of pixels, moved by what deforms their target.
Eigen::Matrix3Xd deformed_points(const Evaluation& e) {
  const Observation& o = e.observation;
  if (!o.deformation.amounts.exists()) return o.points;
  const Eigen::MatrixXd& D = o.deformation.displacements;
  const Eigen::VectorXd moved = D * Eigen::Map<const Eigen::VectorXd>(e.of(o.deformation.amounts), D.cols());
  return o.points + moved.reshaped(3, o.points.cols());
}

/// A pixel over its standard deviation, and its derivatives where they are wanted.
struct PixelRows {
  Eigen::Vector2d r;
  Eigen::Matrix<double, 2, 6> by_chain;  ///< By the right perturbation of the target; its left half by the point.
  Eigen::Matrix<double, 2, Pinhole::parameter_count> by_camera;
};

/// Calls visit(k, PixelRows) for each pixel that has a part; false where a point is beyond what the camera can see.
template <class Visit>
bool each_pixel(const Evaluation& e, const Pose& T, Visit&& visit) {
  const Observation& o = e.observation;
  Pinhole camera;
  camera.set_parameters(Eigen::Map<const Pinhole::Parameters>(e.of(o.camera)));
  const Eigen::Matrix3Xd points = deformed_points(e);
  const bool by_lens = e.wanted(o.camera);
  Eigen::Matrix<double, 2, 3> P;
  PixelRows rows;
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    const double whitening = o.whitening[k];
    if (whitening == 0.0) continue;
    const Eigen::Vector3d point = points.col(k), seen = T * point;
    if (!camera.covers(seen)) return false;
    rows.r = whitening *
             (camera.project(seen, e.jacobians ? &P : nullptr, by_lens ? &rows.by_camera : nullptr) - o.pixels.col(k));
    if (e.jacobians) {
      rows.by_chain.leftCols<3>() = whitening * P * T.linear();
      rows.by_chain.rightCols<3>() = -rows.by_chain.leftCols<3>() * skew(point);
      if (by_lens) rows.by_camera *= whitening;
    }
    visit(k, rows);
  }
  return true;
}

bool pixel_residual(const Evaluation& e, const ChainState& state) {
  const Observation& o = e.observation;
  const bool by_lens = e.wanted(o.camera), by_shape = e.wanted(o.deformation.amounts);
  Eigen::Matrix<double, Eigen::Dynamic, 6> by_chain =
      Eigen::Matrix<double, Eigen::Dynamic, 6>::Zero(e.jacobians ? e.rows : 0, 6);
  e.out().setZero();
  const bool exists = each_pixel(e, state.T, [&](Eigen::Index k, const PixelRows& pixel) {
    e.out().segment<2>(2 * k) = pixel.r;
    if (!e.jacobians) return;
    by_chain.middleRows<2>(2 * k) = pixel.by_chain;
    if (by_lens) e.by(o.camera).middleRows<2>(2 * k) = pixel.by_camera;
    if (by_shape)
      e.by(o.deformation.amounts).middleRows<2>(2 * k) =
          pixel.by_chain.leftCols<3>() * o.deformation.displacements.middleRows<3>(3 * k);
  });
  if (!exists || !e.out().allFinite()) return false;
  add_chain(e, state, by_chain);
  return true;
}

constexpr int rows_of_pose = 7;  // six that hang on it, and what is left

/// The pixels of a known camera by seven rows: with H = J' J = M' M and g = J' r, the rows M d + M^-T g have the
/// information H, the gradient g and, with a last row that does not depend on d, the squares of r.
bool condensed_pixel_residual(const Evaluation& e, const ChainState& state) {
  Matrix6 H = Matrix6::Zero();
  Vector6 g = Vector6::Zero();
  double squares = 0.0;
  const bool exists = each_pixel(e, state.T, [&](Eigen::Index, const PixelRows& pixel) {
    squares += pixel.r.squaredNorm();
    if (!e.jacobians) return;
    H.noalias() += pixel.by_chain.transpose() * pixel.by_chain;
    g.noalias() += pixel.by_chain.transpose() * pixel.r;
  });
  if (!exists || !std::isfinite(squares)) return false;
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
  for (const FitBlock block : {point.block, other.block, radius, camera, deformation.amounts}) use(block);
}

int Observation::condensed_rows(const std::vector<Block>& all) const {
  if (kind != ObservationKind::Pixels) return rows;
  for (const FitBlock block : {camera, deformation.amounts})
    if (block.exists() && all[static_cast<std::size_t>(block.index)].any_free()) return rows;
  return std::min(rows, rows_of_pose);
}

bool Observation::evaluate(const std::vector<Block>& all, const double* const* values, int row_count, double weight,
                           double* residuals, double* const* jacobians) const {
  const auto stored = [&](std::size_t k) { return row_count * all[static_cast<std::size_t>(blocks[k])].values.size(); };
  for (std::size_t k = 0; jacobians && k < blocks.size(); ++k)
    if (jacobians[k]) std::fill_n(jacobians[k], stored(k), 0.0);
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
      exists = row_count < rows ? condensed_pixel_residual(e, *state) : pixel_residual(e, *state);
      break;
  }
  const double scale = std::sqrt(weight);
  if (exists && scale != 1.0) {
    Eigen::Map<Eigen::VectorXd>(residuals, row_count) *= scale;
    for (std::size_t k = 0; jacobians && k < blocks.size(); ++k)
      if (jacobians[k]) Eigen::Map<Eigen::VectorXd>(jacobians[k], stored(k)) *= scale;
  }
  return exists;
}

}  // namespace kr5::fit
