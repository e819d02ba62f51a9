// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/vision/camera_calibration.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include <Eigen/Cholesky>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>

#include "vision/camera_calibration/camera_by_visp.hpp"
#include "vision/camera_calibration/camera_findings.hpp"
#include "vision/camera_calibration/camera_stages.hpp"
#include "vision/camera_calibration/check_views.hpp"
#include "vision/camera_calibration/model_selection.hpp"
#include "vision/camera_calibration/view_test.hpp"

namespace kr5::vision {

namespace {

using namespace detail;
constexpr double max_focal_uncertainty = 0.05;  // relative; beyond it focal length and distance are not separable

/// Covariance of the free parameters, empty when the data do not determine them.
Eigen::MatrixXd covariance_of(const RobustAdjustment& fit, const std::vector<ViewEquations>& equations,
                              Eigen::Index free) {
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(free, free);
  for (std::size_t i = 0; i < fit.weights.size(); ++i)
    if (fit.weights[i].size()) A += equations[i].reduced();
  const Eigen::VectorXd scale = A.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const SymmetricEigen eigen = symmetric_eigen(scale.asDiagonal() * A * scale.asDiagonal());
  if (!A.allFinite() || !(eigen.values[0] > 1e-13)) return {};
  const Eigen::MatrixXd half =
      scale.asDiagonal() * eigen.vectors * eigen.values.cwiseSqrt().cwiseInverse().asDiagonal();
  return half * half.transpose();
}

/// Between the normal of a flat target and the optical axis [rad].
double tilt_of(const CameraProblem& problem, const Pose& T_camera_target) {
  const Eigen::Vector3d normal = T_camera_target.linear() * problem.plane.basis.col(2);
  return problem.plane.flat ? std::acos(std::min(std::abs(normal.z()), 1.0)) : 0.0;
}

void report_view(const CameraProblem& problem, const RobustAdjustment& fit, const ViewEquations& equations,
                 const Eigen::MatrixXd& covariance, const CameraState& state, std::size_t i, CameraViewReport& report) {
  const Pose& T = report.T_camera_target = state.poses[i];
  report.residuals = residuals(problem, state, i);
  if (report.residuals.cols() == 0) {
    report.outlier = true;
    report.weight = 0;
    if (report.reason.empty())
      report.reason = "with this camera its points would lie behind the camera or outside the range of the lens";
    return;
  }
  report.rms_px = std::sqrt(report.residuals.colwise().squaredNorm().mean());
  report.noise_px = noise_of(report.residuals, true, 6);
  report.tilt = tilt_of(problem, T);
  report.weights = huber_weights(report.residuals, report.noise_px);
  report.weight = 0;
  if (!fit.weights[i].size()) return;
  report.weight = fit.weights[i].maxCoeff() * fit.sigma * fit.sigma;
  const Matrix6 inverse = equations.pose.inverse();
  const Eigen::MatrixXd gain = inverse * equations.cross.transpose();
  report.covariance = inverse + gain * covariance * gain.transpose();
}

/// Everything that follows from the last fit.
void report_fit(const CameraProblem& problem, const CameraModel& model, const RobustAdjustment& fit,
                const std::vector<bool>& used, double correlation, CameraCalibration& result) {
  const Eigen::MatrixXd basis = free_basis(model);
  const std::vector<ViewEquations> equations = fit.adjustment.equations();
  result.dispersion = test_views(fit, used, correlation, result.views).dispersion;
  const Eigen::MatrixXd covariance =
      std::max(result.dispersion, correlation) * covariance_of(fit, equations, basis.cols());
  CameraState state = fit.adjustment.state();
  const int width = result.camera.width, height = result.camera.height;
  result.camera = state.camera;
  result.camera.width = width, result.camera.height = height;
  result.target_shape = state.shape;
  result.lens = model.lens, result.square_pixels = model.square_pixels, result.bent_target = model.bent_target;
  result.free = free_names(model);
  result.sigma_pixel = fit.sigma;
  double sum = 0;
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    if (!fit.weights[i].size())
      state.poses[i] =
          fit_pose(problem, state, i, Eigen::VectorXd::Ones(problem.views[i].points.cols())).T_camera_target;
    report_view(problem, fit, equations[i],
                covariance.size() ? covariance : Eigen::MatrixXd::Zero(basis.cols(), basis.cols()), state, i,
                result.views[i]);
    if (fit.weights[i].size()) sum += result.views[i].residuals.squaredNorm();
  }
  result.rms_px = std::sqrt(sum / std::max(fit.points, 1));
  result.fit.iterations += fit.adjustment.iterations();
  result.fit.final_rms = fit.sigma > 0 ? std::sqrt(0.5 * sum / std::max(fit.points, 1)) / fit.sigma : 0;
  if (covariance.size() == 0) return;
  const Eigen::MatrixXd wide = basis * covariance * basis.transpose();
  result.covariance = wide.topLeftCorner<Pinhole::parameter_count, Pinhole::parameter_count>();
  const bool known = std::sqrt(result.covariance(0, 0)) < max_focal_uncertainty * result.camera.fx &&
                     std::sqrt(result.covariance(1, 1)) < max_focal_uncertainty * result.camera.fy;
  if (known && result.camera.fx > 0 && result.camera.fy > 0 && fit.sigma > 0)
    result.fit.status = fit.adjustment.converged() ? FitStatus::Converged : FitStatus::MaxIterations;
}

CameraModel choose_model(const CameraProblem& problem, const RobustAdjustment& reference, const std::vector<bool>& used,
                         const CameraOptions& options, CameraCalibration& result) {
  CameraModel chosen = reference_model(options);
  const auto views = std::count(used.begin(), used.end(), true);
  if (options.folds == 0) return chosen;
  if (views < 4) {  // too few to hold any out: the lens most cameras have
    if (!options.lens) chosen.lens = LensModel::K1K2;
    if (!options.square_pixels) chosen.square_pixels = true;
    return chosen;
  }
  result.models = compare_models(problem, reference, used, options);
  for (const CameraModelScore& s : result.models)
    if (s.chosen) {
      chosen = {s.lens, s.square_pixels, s.bent_target};
      result.held_out_rms = s.held_out_rms;
    }
  return chosen;
}

/// Poses of the targets as they are guessed, by which findings tell why there is no camera.
void report_guess(const CameraProblem& problem, const CameraState& guess, std::vector<CameraViewReport>& reports) {
  for (std::size_t i = 0; i < reports.size(); ++i) {
    reports[i].T_camera_target = guess.poses[i];
    reports[i].tilt = tilt_of(problem, guess.poses[i]);
  }
}

/// ViSP's camera, judged by our equations there with the weights of its least squares; why it has none.
std::string calibrate_by_visp(const CameraProblem& problem, const CameraStart& start, const CameraOptions& options,
                              CameraCalibration& result) {
  const CameraModel model{options.lens.value_or(LensModel::K1)};
  const CameraByVisp visp = camera_by_visp(problem, start.states.front(), start.sound, model.lens);
  if (!visp.failure.empty()) {
    report_guess(problem, start.states.front(), result.views);
    return visp.failure;
  }
  constexpr bool robust = false;
  const RobustAdjustment fit = adjust_robustly(problem, model, visp.state, start.sound, robust, 0);
  report_fit(problem, model, fit, start.sound, options.correlation, result);
  if (result.fit.usable()) result.fit.status = FitStatus::Converged;
  return {};
}

/// By the pipeline; what it says of a second minimum, which is found under the reference model and told under it.
std::optional<SecondCamera> calibrate_robustly(const CameraProblem& problem, CameraStages& stages,
                                               const CameraOptions& options, CameraCalibration& result) {
  const auto rival = fit::pipeline::run(stages);
  const CameraState best = stages.place();
  stages.name_outliers();
  const std::vector<bool> used = stages.used();
  const CameraModel model = choose_model(problem, *stages.fit, used, options, result);
  if (!(model == reference_model(options)))
    stages.fit = adjust_robustly(problem, model, stages.fit->adjustment.state(), used, options.robust, 3);
  result.fit.iterations = stages.rough_iterations;
  report_fit(problem, model, *stages.fit, used, options.correlation, result);
  result.fit.initial_rms = stages.fit->sigma > 0 ? stages.initial_rms / stages.fit->sigma : 0;
  if (!rival || !result.fit.usable()) return std::nullopt;
  return stages.second(best, *rival, std::max(result.dispersion, options.correlation));
}

/// Refuses what ViSP would ignore.
void require_visp_has(const CameraOptions& options) {
  require(!options.lens || *options.lens == LensModel::None || *options.lens == LensModel::K1,
          "lens must be none or k1 with the method visp, which has no other");
  const CameraOptions usual;
  const std::pair<bool, const char*> set[] = {{options.square_pixels.has_value(), "square_pixels"},
                                              {options.bent_target.has_value(), "bent_target"},
                                              {options.reject_views != usual.reject_views, "reject_views"},
                                              {options.false_alarm != usual.false_alarm, "false_alarm"},
                                              {options.folds != usual.folds, "folds"},
                                              {options.max_iterations != usual.max_iterations, "max_iterations"}};
  for (const auto& [given, field] : set)
    require(!given, std::string(field) + ": the method visp has no such choice; leave it as it is by default");
}

}  // namespace

void CameraOptions::validate() const {
  if (method == CameraMethod::Visp) require_visp_has(*this);
  require(false_alarm > 0 && false_alarm < 0.5, "false_alarm must lie between 0 and 0.5 [-]");
  require(std::isfinite(correlation) && correlation >= 1, "correlation must be at least 1 [-]");
  require(folds == 0 || folds >= 2, "folds must be 0 or at least 2");
  require(folds != 0 || lens, "folds = 0 compares no models: state the lens");
  require(max_iterations >= 5, "max_iterations must be at least 5");
}

CameraCalibration calibrate_camera(std::span<const View> views, int width, int height, const CameraOptions& options) {
  options.validate();
  check_views(views, width, height);
  CameraCalibration result;
  result.camera.width = width, result.camera.height = height;
  const CameraProblem problem{views, common_plane(views), options.max_iterations};
  const CameraStart start = guess_camera(views, width, height);
  CameraStages stages(problem, options, start, result.views);
  std::optional<SecondCamera> second;
  std::vector<bool> used = start.sound;
  std::string failure;
  if (options.method == CameraMethod::Visp) {
    if (stages.any()) failure = calibrate_by_visp(problem, start, options, result);
  } else if (stages.any()) {
    second = calibrate_robustly(problem, stages, options, result);
    used = stages.used();
  }
  result.coverage = coverage_of(views, result.views, width, height);
  add_findings(used, problem.plane, second, result);
  if (!failure.empty()) result.fit.message = failure + "; " + result.fit.message;
  return result;
}

}  // namespace kr5::vision
