// SPDX-License-Identifier: BSD-3-Clause
#include "vision/camera_calibration/camera_adjustment.hpp"

#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

namespace kr5::vision::detail {
namespace {

using Matrix23 = Eigen::Matrix<double, 2, 3>;
constexpr double infinite = std::numeric_limits<double>::infinity();

/// The lens model holds for the point: in front, away from the pole of the rational factor, and before its fold.
bool within_lens_model(const Pinhole& c, const Eigen::Vector3d& p) {
  if (!(p.z() > 1e-9)) return false;
  const double r = p.head<2>().squaredNorm() / (p.z() * p.z());
  return r < 25.0 && 1 + r * (c.k4 + r * (c.k5 + r * c.k6)) > 0.05;
}

double view_cost(const CameraProblem& problem, const CameraState& state, std::size_t view,
                 const Eigen::VectorXd& weights) {
  const Eigen::Matrix2Xd e = residuals(problem, state, view);
  return e.cols() == 0 ? infinite : e.colwise().squaredNorm().dot(weights);
}

double total_cost(const CameraProblem& problem, const CameraState& state, const Weights& weights) {
  double cost = 0;
  for (std::size_t i = 0; i < problem.views.size(); ++i)
    if (weights[i].size()) cost += view_cost(problem, state, i, weights[i]);
  return cost;
}

ViewEquations view_equations(const CameraProblem& problem, const Eigen::MatrixXd& basis, const CameraState& state,
                             std::size_t view, const Eigen::VectorXd& weights) {
  Eigen::VectorXd r;
  Eigen::MatrixXd K;
  Eigen::Matrix<double, Eigen::Dynamic, 6> P;
  ViewEquations block;
  if (!linearise(problem, state, view, r, K, P)) {
    block.cost = infinite;
    return block;
  }
  Eigen::VectorXd root(r.size());
  for (Eigen::Index i = 0; i < weights.size(); ++i) root.segment<2>(2 * i).setConstant(std::sqrt(weights[i]));
  const Eigen::MatrixXd F = root.asDiagonal() * (K * basis);
  P.array().colwise() *= root.array();
  r.array() *= root.array();
  block.pose.noalias() = P.transpose() * P;
  block.pose_gradient.noalias() = P.transpose() * r;
  block.cross.noalias() = F.transpose() * P;
  block.shared.noalias() = F.transpose() * F;
  block.shared_gradient.noalias() = F.transpose() * r;
  block.cost = r.squaredNorm();
  return block;
}

/// One damped step; the change of the free parameters and of each pose.
struct Step {
  Eigen::VectorXd shared;
  std::vector<Vector6> poses;
};

Step solve(const std::vector<ViewEquations>& blocks, const Weights& weights, Eigen::Index free, double damping) {
  const double d = 1 + damping;
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(free, free);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(free);
  std::vector<Eigen::LDLT<Matrix6>> factors(blocks.size());
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (!weights[i].size()) continue;
    Matrix6 U = blocks[i].pose;
    U.diagonal() *= d;
    factors[i].compute(U);
    if (free == 0) continue;
    S += blocks[i].shared;
    S.diagonal() += damping * blocks[i].shared.diagonal();
    S -= blocks[i].cross * factors[i].solve(blocks[i].cross.transpose());
    g += blocks[i].shared_gradient - blocks[i].cross * factors[i].solve(blocks[i].pose_gradient);
  }
  Step step;
  step.shared = Eigen::VectorXd::Zero(free);
  if (free > 0) {  // scaled, because pixels and distortion coefficients differ by orders of magnitude
    const Eigen::VectorXd scale = S.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = scale.asDiagonal() * S * scale.asDiagonal();
    step.shared = scale.asDiagonal() * scaled.ldlt().solve(scale.asDiagonal() * g);
  }
  step.poses.assign(blocks.size(), Vector6::Zero());
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (!weights[i].size()) continue;
    Vector6 b = blocks[i].pose_gradient;
    if (free > 0) b -= blocks[i].cross.transpose() * step.shared;
    step.poses[i] = factors[i].solve(b);
  }
  return step;
}

CameraState moved(const CameraState& state, const Eigen::MatrixXd& basis, const Step& step) {
  CameraState out = state;
  if (basis.cols() > 0) {
    const Eigen::VectorXd change = basis * step.shared;
    out.camera.set_parameters(state.camera.parameters() + change.head<Pinhole::parameter_count>());
    out.shape += change.tail<shape_count>();
  }
  for (std::size_t i = 0; i < out.poses.size(); ++i) {
    if (!step.poses[i].isZero(0)) out.poses[i] = state.poses[i] * to_pose(step.poses[i]);
  }
  return out;
}

std::vector<ViewEquations> make_blocks(const CameraProblem& problem, const Eigen::MatrixXd& basis,
                                       const CameraState& state, const Weights& weights) {
  std::vector<ViewEquations> blocks(problem.views.size());
  for (std::size_t i = 0; i < blocks.size(); ++i)
    if (weights[i].size()) blocks[i] = view_equations(problem, basis, state, i, weights[i]);
  return blocks;
}

}  // namespace

Eigen::MatrixXd ViewEquations::reduced() const { return shared - cross * pose.ldlt().solve(cross.transpose()); }

Eigen::VectorXd ViewEquations::reduced_gradient() const {
  return shared_gradient - cross * pose.ldlt().solve(pose_gradient);
}

Eigen::Matrix2Xd residuals(const CameraProblem& problem, const CameraState& state, std::size_t view) {
  const View& v = problem.views[view];
  const bool bent = !state.shape.isZero(0);
  Eigen::Matrix2Xd e(2, v.points.cols());
  for (Eigen::Index i = 0; i < v.points.cols(); ++i) {
    const Eigen::Vector3d p = v.points.col(i);
    const Eigen::Vector3d c = state.poses[view] * (bent ? bend(problem.plane, state.shape, p) : p);
    if (!within_lens_model(state.camera, c)) return Eigen::Matrix2Xd(2, 0);
    e.col(i) = v.pixels.col(i) - state.camera.project(c);
  }
  return e;
}

bool linearise(const CameraProblem& problem, const CameraState& state, std::size_t view, Eigen::VectorXd& r,
               Eigen::MatrixXd& by_shared, Eigen::Matrix<double, Eigen::Dynamic, 6>& by_pose) {
  const View& v = problem.views[view];
  const Eigen::Index n = v.points.cols();
  r.resize(2 * n);
  by_shared.resize(2 * n, shared_count);
  by_pose.resize(2 * n, 6);
  const Eigen::Matrix3d R = state.poses[view].linear();
  for (Eigen::Index i = 0; i < n; ++i) {
    Eigen::Matrix<double, 3, shape_count> by_shape;
    const Eigen::Vector3d p = bend(problem.plane, state.shape, v.points.col(i), &by_shape);
    const Eigen::Vector3d c = state.poses[view] * p;
    if (!within_lens_model(state.camera, c)) return false;
    Matrix23 J;
    Eigen::Matrix<double, 2, Pinhole::parameter_count> K;
    r.segment<2>(2 * i) = v.pixels.col(i) - state.camera.project(c, &J, &K);
    const Matrix23 JR = J * R;
    by_shared.block<2, Pinhole::parameter_count>(2 * i, 0) = K;
    by_shared.block<2, shape_count>(2 * i, Pinhole::parameter_count) = JR * by_shape;
    by_pose.block<2, 3>(2 * i, 0) = JR;
    by_pose.block<2, 3>(2 * i, 3) = -JR * skew(p);
  }
  return true;
}

Adjustment adjust(const CameraProblem& problem, const Eigen::MatrixXd& basis, CameraState start, const Weights& weights,
                  int max_iterations) {
  Adjustment out;
  out.state = std::move(start);
  out.blocks = make_blocks(problem, basis, out.state, weights);
  out.cost = total_cost(problem, out.state, weights);
  double damping = 1e-4;
  while (std::isfinite(out.cost) && out.iterations < max_iterations && !out.converged) {
    ++out.iterations;
    const Step step = solve(out.blocks, weights, basis.cols(), damping);
    const CameraState next = moved(out.state, basis, step);
    const double cost = total_cost(problem, next, weights);
    if (!(cost <= out.cost)) {
      damping *= 8;
      out.converged = damping > 1e12;  // no direction leads down any more
      continue;
    }
    out.converged = out.cost - cost <= 1e-8 * out.cost + 1e-14;
    damping = std::max(damping / 8, 1e-12);
    out.state = next;
    out.cost = cost;
    out.blocks = make_blocks(problem, basis, out.state, weights);
  }
  return out;
}

Pose fit_pose(const CameraProblem& problem, const CameraState& state, std::size_t view,
              const Eigen::VectorXd& weights) {
  CameraProblem one{problem.views.subspan(view, 1), problem.plane, problem.max_iterations};
  CameraState start = state;
  start.poses = {state.poses[view]};
  return adjust(one, Eigen::MatrixXd(shared_count, 0), start, {weights}, problem.max_iterations).state.poses[0];
}

}  // namespace kr5::vision::detail
