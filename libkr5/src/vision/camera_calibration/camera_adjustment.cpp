// SPDX-License-Identifier: BSD-3-Clause
#include "vision/camera_calibration/camera_adjustment.hpp"

#include <algorithm>

#include <Eigen/Cholesky>
#include <kr5/fit/measurements/pixels.hpp>

namespace kr5::vision::detail {
namespace {

constexpr double min_decrease = 1e-8;  // of the cost, relative, at which an adjustment ends

Eigen::VectorXd sigmas_of(const Eigen::VectorXd& weights) { return weights.cwiseSqrt().cwiseInverse(); }

}  // namespace

Eigen::MatrixXd ViewEquations::reduced() const { return shared - cross * pose.ldlt().solve(cross.transpose()); }

Eigen::VectorXd ViewEquations::reduced_gradient() const {
  return shared_gradient - cross * pose.ldlt().solve(pose_gradient);
}

Eigen::Matrix2Xd residuals(const CameraProblem& problem, const CameraState& state, std::size_t view) {
  const View& v = problem.views[view];
  const Eigen::Matrix3Xd points = bent_points(problem.plane, state.shape, v.points);
  Eigen::Matrix2Xd e(2, v.points.cols());
  for (Eigen::Index i = 0; i < v.points.cols(); ++i) {
    const Eigen::Vector3d c = state.poses[view] * Eigen::Vector3d(points.col(i));
    if (!state.camera.covers(c)) return Eigen::Matrix2Xd(2, 0);
    e.col(i) = v.pixels.col(i) - state.camera.project(c);
  }
  return e;
}

CameraAdjustment::CameraAdjustment(const CameraProblem& problem, const CameraModel& model, const CameraState& start)
    : used_(problem.views.size(), true), state_(start), max_iterations_(problem.max_iterations) {
  apply_model(model, state_.camera, state_.shape);
  camera_ = fit_.add_camera("camera", state_.camera);
  if (model.bent_target) shape_ = fit_.add_vector("target", state_.shape, {shape_names.begin(), shape_names.end()});
  const std::vector<int> free = free_parameters(model);
  if (model.square_pixels) fit_.tie(camera_, 0, 1);
  for (int k = 0; k < Pinhole::parameter_count; ++k)
    if (std::find(free.begin(), free.end(), k) == free.end() && !(k == 1 && model.square_pixels)) fit_.hold(camera_, k);
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    const View& view = problem.views[i];
    poses_.push_back(fit_.add_nuisance_pose(view.name, state_.poses[i]));
    fit::FitDeformation deformation;
    if (shape_.exists()) deformation = {shape_, displacements(problem.plane, view.points)};
    views_.push_back(fit_.add(
        fit::PixelMeasurement(fit::PoseChain().then(poses_[i]), camera_, view.points, view.pixels, 1.0, deformation)));
  }
}

void CameraAdjustment::set_weights(const Weights& weights) {
  for (std::size_t i = 0; i < views_.size(); ++i) {
    used_[i] = weights[i].size() > 0;
    fit_.set_weight(views_[i], used_[i] ? 1.0 : 0.0);
    if (used_[i]) fit_.measurement<fit::PixelMeasurement>(views_[i]).set_sigmas(sigmas_of(weights[i]));
  }
}

void CameraAdjustment::minimise() {
  if (!fit_.any_free()) return;  // no view is left
  const fit::Solution result =
      fit_.solve({.max_iterations = max_iterations_, .cost_tolerance = min_decrease, .uncertainty = false});
  cost_ = result.cost;
  iterations_ += result.fit.iterations;
  converged_ = result.fit.status == FitStatus::Converged;
  state_.camera = fit_.camera(camera_);
  if (shape_.exists()) state_.shape = fit_.values(shape_);
  for (std::size_t i = 0; i < poses_.size(); ++i)
    if (used_[i]) state_.poses[i] = fit_.pose(poses_[i]);
}

std::vector<ViewEquations> CameraAdjustment::equations() const {
  std::vector<ViewEquations> out(views_.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    const auto at = used_[i] ? fit_.derivatives(views_[i]) : std::nullopt;
    if (!at) continue;
    const Eigen::MatrixXd &F = at->by_coordinate, &P = at->by_nuisance;
    out[i].pose.noalias() = P.transpose() * P;
    out[i].cross.noalias() = F.transpose() * P;
    out[i].shared.noalias() = F.transpose() * F;
    out[i].pose_gradient.noalias() = P.transpose() * at->residuals;
    out[i].shared_gradient.noalias() = F.transpose() * at->residuals;
  }
  return out;
}

ViewPose fit_pose(const CameraProblem& problem, const CameraState& state, std::size_t view,
                  const Eigen::VectorXd& weights) {
  const View& v = problem.views[view];
  fit::Problem fit;
  const fit::FitBlock camera = fit.add_camera("camera", state.camera), pose = fit.add_pose(v.name, state.poses[view]);
  fit.hold(camera);
  const fit::FitMeasurement pixels = fit.add(fit::PixelMeasurement(
      fit::PoseChain().then(pose), camera, bent_points(problem.plane, state.shape, v.points), v.pixels, 1.0));
  fit.measurement<fit::PixelMeasurement>(pixels).set_sigmas(sigmas_of(weights));
  fit.solve({.max_iterations = problem.max_iterations, .cost_tolerance = min_decrease, .uncertainty = false});
  return {fit.pose(pose), fit.derivatives(pixels)};
}

}  // namespace kr5::vision::detail
