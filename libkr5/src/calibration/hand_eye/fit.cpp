// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/hand_eye/fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <kr5/fit/measurements/pixels.hpp>
#include <kr5/fit/measurements/pose.hpp>

namespace kr5::calibration::hand_eye {
namespace {

constexpr double student_dof = 4.0;
constexpr int variance_steps = 20;  // at most, with the views as they are
constexpr int weight_steps = 20;    // likewise

/// Standard deviation of each point of a view over that of a pixel [-]. The fit counts in standard deviations of a
/// pixel, so that it need not be told of their change.
Eigen::VectorXd point_sigmas(const ObservedView& observed) {
  return (observed.input->correlation * observed.pose().weights.cwiseInverse()).cwiseSqrt();
}

}  // namespace

fit::PoseChain robot_error_chain(Mount mount, const Pose& T_base_flange, fit::FitBlock X, fit::FitBlock Z,
                                 fit::FitBlock seen) {
  fit::PoseChain out;
  out.then(T_base_flange.inverse());
  if (mount == Mount::EyeInHand) return out.then(Z).then_inverse(seen).then_inverse(X);
  return out.then(X).then(seen).then_inverse(Z);
}

HandEyeFit::HandEyeFit(Mount mount, const Pinhole& camera, std::vector<ObservedView> observed_views)
    : weights(observed_views.size(), 1.0), mount_(mount), camera_(camera), views_(std::move(observed_views)) {
  const fit::FitBlock lens = fit_.add_camera("camera", camera_);
  fit_.hold(lens);
  X_ = fit_.add_pose("T_mount_camera", Pose::Identity());
  Z_ = fit_.add_pose("T_fixed_target", Pose::Identity());
  for (const ObservedView& observed : views_) {
    const View& view = observed.input->view;
    seen_.push_back(fit_.add_nuisance_pose("T_camera_target"));
    pixels_.push_back(
        fit_.add(fit::PixelMeasurement(fit::PoseChain().then(seen_.back()), lens, view.points, view.pixels, 1.0)));
    robot_.push_back(
        fit_.add(fit::PoseMeasurement(robot_error_chain(mount, observed.input->T_base_flange, X_, Z_, seen_.back()),
                                      Pose::Identity(), Matrix6(Matrix6::Identity()))));
  }
}

Vector6 HandEyeFit::error(std::size_t i) const {
  return robot_residual(mount_, poses(), views_[i].input->T_base_flange, fit_.pose(seen_[i]));
}

void HandEyeFit::begin_at(const Poses& poses, const std::vector<ObservedView>& observed_views) {
  views_ = observed_views;
  fit_.begin_at(X_, poses.X);
  fit_.begin_at(Z_, poses.Z);
  for (std::size_t i = 0; i < views_.size(); ++i) choose(i, views_[i].chosen);
}

void HandEyeFit::choose(std::size_t i, int pose) {
  views_[i].chosen = pose;
  fit_.measurement<fit::PixelMeasurement>(pixels_[i]).set_sigmas(point_sigmas(views_[i]));
  restart(i);
}

void HandEyeFit::restart(std::size_t i) { fit_.begin_at(seen_[i], views_[i].pose().T_camera_points); }

std::optional<LinearView> HandEyeFit::linear(std::size_t i) const {
  const auto at = fit_.derivatives(pixels_[i], true);
  if (!at) return std::nullopt;
  // r + N d is least for d = -(N' N)^-1 N' r: the pose of the target that the pixels ask for.
  const Eigen::Matrix<double, Eigen::Dynamic, 6> N = at->by_nuisance;
  const Vector6 g = N.transpose() * at->residuals, e = error(i);
  const Matrix6 inverse = Matrix6(N.transpose() * N).ldlt().solve(Matrix6::Identity());
  const RobotDerivatives by = robot_derivatives(mount_, poses(), fit_.pose(seen_[i]), e);
  LinearView out;
  out.y = e - by.by_target_seen * inverse * g;
  out.F << -by.by_x, -by.by_z;
  out.U = by.by_target_seen * inverse * by.by_target_seen.transpose();
  out.pixel_squares = views_[i].input->correlation * std::max(at->residuals.squaredNorm() - g.dot(inverse * g), 0.0);
  out.pixel_dof = 2.0 * views_[i].pose().weights.sum() - 6.0;
  if (!out.U.allFinite() || !out.y.allFinite()) return std::nullopt;
  return out;
}

std::vector<WeightedView> HandEyeFit::active() const {
  std::vector<WeightedView> out;
  for (std::size_t i = 0; i < views_.size(); ++i)
    if (weights[i] > 0)
      if (const auto view = linear(i)) out.push_back({*view, weights[i]});
  return out;
}

/// Moves free variances and, with `student`, weights to where the views as they are now put them. Whether they are
/// about where they were, and the poses with them.
bool HandEyeFit::update_weights(bool student) {
  std::vector<WeightedView> views;
  std::vector<std::size_t> index;
  for (std::size_t i = 0; i < views_.size(); ++i) {
    if (!(weights[i] > 0)) continue;
    const auto view = linear(i);
    if (!view) continue;
    views.push_back({*view, weights[i]});
    index.push_back(i);
  }
  const Eigen::Vector3d before = variances.value;
  for (int step = 0; step < weight_steps; ++step) {
    estimate_variances(views, variances, variance_steps);
    estimate = solve(views, variances);
    double changed = 0;
    for (std::size_t k = 0; student && k < views.size(); ++k) {
      const Vector6 r = views[k].view.y - views[k].view.F * estimate.b;
      const double weight = (student_dof + 6) / (student_dof + r.dot(variances.of(views[k].view).ldlt().solve(r)));
      changed = std::max(changed, std::abs(weight - views[k].weight));
      views[k].weight = weight;
    }
    if (changed < 0.01) break;
  }
  double reweighted = 0;
  for (std::size_t k = 0; k < views.size(); ++k) {
    reweighted = std::max(reweighted, std::abs(views[k].weight - weights[index[k]]));
    weights[index[k]] = views[k].weight;
  }
  const double varied = (variances.value.cwiseQuotient(before).array() - 1).abs().maxCoeff();
  const Vector12 sigma = estimate.covariance.diagonal().cwiseSqrt();
  return reweighted < 0.05 && varied < 1e-3 && estimate.b.cwiseQuotient(sigma).cwiseAbs().maxCoeff() < 1e-4;
}

/// The fit with the present variances and weights; whether it found an optimum.
bool HandEyeFit::move(int max_iterations) {
  const Matrix6 robot = variances.robot() / variances.value[2];
  for (std::size_t i = 0; i < views_.size(); ++i) {
    // One beyond the range of the lens has no part, here as in update_weights().
    const double weight = fit_.residuals(pixels_[i]).allFinite() ? weights[i] : 0.0;
    fit_.set_weight(pixels_[i], weight);
    fit_.set_weight(robot_[i], weight);
    fit_.set_covariance(robot_[i], robot);
  }
  const FitReport report = fit_.solve({.max_iterations = max_iterations, .uncertainty = false}).fit;
  iterations += std::max(report.iterations, 1);
  return report.usable();
}

void HandEyeFit::settle(int max_iterations, bool student) {
  const int end = iterations + max_iterations;
  update_weights(student);
  settled = false;
  while (!settled && estimate.regular && iterations < end && move(end - iterations)) settled = update_weights(student);
}

double HandEyeFit::deleted_distance(std::size_t i) const {
  const auto view = linear(i);
  if (!view) return std::numeric_limits<double>::infinity();
  const Matrix6 spread = view->F * estimate.covariance * view->F.transpose();
  const Matrix6 V = variances.of(*view);
  const Matrix6 Q = weights[i] > 0 ? Matrix6(V - spread) : Matrix6(V + spread);
  return std::max(0.0, view->y.dot(Q.ldlt().solve(view->y)));
}

}  // namespace kr5::calibration::hand_eye
