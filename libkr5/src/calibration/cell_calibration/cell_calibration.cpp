// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/cell_calibration.hpp>

#include <algorithm>
#include <cmath>
#include <set>

#include <Eigen/Dense>
#include <kr5/calibration/scanner_points.hpp>
#include <kr5/core/error.hpp>
#include <kr5/fit/pipeline/pipeline.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "calibration/cell_calibration/cell_estimation.hpp"
#include "calibration/hand_eye/second_pose.hpp"
#include "calibration/parameters/parameter_report.hpp"
#include "calibration/scanner/scanner_start.hpp"

namespace kr5::calibration {
namespace {

using namespace cell_calibration;

void check_stops(std::span<const CellStop> stops, const CellGeometry& believed) {
  std::set<int> ids;
  for (const MapMarker& marker : believed.markers)
    require(ids.insert(marker.id).second, "markers: id " + std::to_string(marker.id) + " is listed twice");
  const auto joints = static_cast<Eigen::Index>(believed.arm.joints.size());
  for (std::size_t i = 0; i < stops.size(); ++i) {
    const View& view = stops[i].view.view;
    const std::string where = "view " + (view.name.empty() ? std::to_string(i) : view.name) + ": ";
    require(view.points.cols() == view.pixels.cols(), where + std::to_string(view.points.cols()) + " points, but " +
                                                          std::to_string(view.pixels.cols()) + " pixels");
    if (joints > 0)
      require(stops[i].q.size() == joints && stops[i].q.allFinite(), where + "expected " + std::to_string(joints) +
                                                                         " finite joint values, found " +
                                                                         std::to_string(stops[i].q.size()));
    if (believed.markers.empty()) continue;
    require(static_cast<Eigen::Index>(view.ids.size()) == view.points.cols(),
            where + "every point needs the id of its corner, found " + std::to_string(view.ids.size()) + " ids");
    for (const int id : view.ids)
      require(ids.contains(id / 4), where + "marker " + std::to_string(id / 4) + " is not among the markers");
  }
}

/// `arm` must outlive what is returned.
CellScanInput scan_input(const CellScan& scan, const ScannerResult& found,
                         const std::optional<kinematics::DhChain>& arm) {
  CellScanInput out{.input = {scan.views, scan.targets, scan.options, arm, {}, {}},
                    .sigmas = {.position = found.sigma_position,
                               .across = found.sigma_across,
                               .rotation = scan.options.sigma_rotation},
                    .placement = {},
                    .outlier = {}};
  for (std::size_t i = 0; i < scan.views.size(); ++i) {
    const auto target = std::find_if(scan.targets.begin(), scan.targets.end(),
                                     [&](const ScanTarget& t) { return t.name == scan.views[i].target; });
    out.input.target_of.push_back(static_cast<std::size_t>(target - scan.targets.begin()));
    out.input.T_base_flange.push_back(arm ? arm->flange(scan.views[i].q) : scan.views[i].T_base_flange);
    out.outlier.push_back(found.views[i].outlier);
  }
  out.placement = scanner_problem::place_targets(out.input, found.T_flange_scanner);
  return out;
}

/// Scanner on the flange and in the camera.
void write_scanner(const CellEstimation& estimation, CellCalibrationResult& out) {
  const CellProblem& problem = *estimation.problem;
  const Eigen::MatrixXd& C = estimation.result.covariance;
  const double inflation = uncertainty::covariance_inflation(6, out.scanner_start.dof);
  out.T_flange_scanner = problem.fit.pose(problem.scanner.scanner);
  out.covariance_scanner = inflation * parameters::covariance_of_pose(estimation.result, problem.scanner.scanner, C);
  if (out.mount == Mount::EyeToHand) return;
  const std::vector<int> of_camera = estimation.result.places(problem.mount),
                         of_scanner = estimation.result.places(problem.scanner.scanner);
  const auto held = [](int place) { return place < 0; };
  if (std::any_of(of_camera.begin(), of_camera.end(), held) || std::any_of(of_scanner.begin(), of_scanner.end(), held))
    return;
  const double widest = std::max(inflation, uncertainty::covariance_inflation(6, out.covariance_dof));
  const UncertainPose camera{out.T_mount_camera, widest * C(of_camera, of_camera)},
      scanner{out.T_flange_scanner, widest * C(of_scanner, of_scanner)};
  const UncertainPose between = camera_scanner(camera, scanner, widest * C(of_camera, of_scanner));
  out.T_camera_scanner = between.T;
  out.covariance_camera_scanner = between.covariance;
}

void write_cell_result(const CellEstimation& estimation, CellCalibrationResult& out) {
  const CellProblem& problem = *estimation.problem;
  out.cell = problem.cell(estimation.input.believed);
  out.T_mount_camera = problem.fit.pose(problem.mount);
  out.T_fixed_target = problem.fit.pose(problem.target);
  out.sigma_pixel = estimation.sigmas.pixel;
  out.sigma_robot_position = estimation.sigmas.position;
  out.sigma_robot_rotation = estimation.sigmas.rotation;
  const std::vector<int> of_arm = problem.arm.exists() ? estimation.result.places(problem.arm) : std::vector<int>();
  if (std::any_of(of_arm.begin(), of_arm.end(), [](int place) { return place >= 0; })) {
    out.tolerance_length = estimation.sigmas.length;
    out.tolerance_angle = estimation.sigmas.angle;
  }
  out.covariance_dof = estimation.robot_dof;
  const double of_pose = uncertainty::covariance_inflation(6, out.covariance_dof);
  out.covariance =
      of_pose * parameters::covariance_of_pose(estimation.result, problem.mount, estimation.result.covariance);
  out.covariance_target =
      of_pose * parameters::covariance_of_pose(estimation.result, problem.target, estimation.result.covariance);
  const fit::FitBlock nominal[] = {problem.camera, problem.arm};
  std::vector<fit::FitBlock> others = {problem.mount, problem.target};
  for (const auto& [id, marker] : problem.markers) others.push_back(marker);
  if (problem.scanner.scanner.exists()) {
    write_scanner(estimation, out);
    others.push_back(problem.scanner.scanner);
    others.insert(others.end(), problem.scanner.targets.begin(), problem.scanner.targets.end());
    others.insert(others.end(), problem.scanner.radii.begin(), problem.scanner.radii.end());
  }
  parameters::ParameterReport report =
      parameters::report_parameters(problem.fit, estimation.result, nominal, others,
                                    parameters::same_inflation(estimation.result, 1, out.covariance_dof));
  out.parameters = std::move(report.parameters);
  out.parameter_covariance = std::move(report.covariance);
  out.unidentifiable = estimation.result.unidentifiable;
  out.fit = estimation.result.fit;
  out.fit.iterations = estimation.iterations;
  const std::string open = open_directions(estimation.result);
  if (open.empty()) return;
  out.fit.status = FitStatus::Degenerate;
  out.fit.message = open;
}

double rms_of_view(const HandEyeView& view, Mount mount, const Pose& X, const Pose& Z, const Pinhole& camera) {
  const Pose T = mount == Mount::EyeInHand ? view.T_base_flange.inverse() : view.T_base_flange;
  const Pose M = X.inverse() * T * Z;
  const double diagonal = std::hypot(camera.width, camera.height);
  double squares = 0;
  for (Eigen::Index k = 0; k < view.view.points.cols(); ++k) {
    const Eigen::Vector3d p = M * Eigen::Vector3d(view.view.points.col(k));
    const double off = p.z() > 1e-9 ? (camera.project(p) - view.view.pixels.col(k)).norm() : diagonal;
    squares += std::min(off, diagonal) * std::min(off, diagonal);
  }
  return std::sqrt(squares / static_cast<double>(view.view.points.cols()));
}

}  // namespace

void CellCalibrationOptions::validate() const {
  hand_eye_options(*this).validate();
  require(tolerance_length >= 0, "tolerance_length must not be negative [m]; 0 means estimated");
  require(tolerance_angle >= 0, "tolerance_angle must not be negative [rad]; 0 means estimated");
}

CellCalibrationResult calibrate_cell(std::span<const CellStop> stops, const CellGeometry& believed,
                                     const CellCalibrationOptions& options, const CellScan& scan) {
  options.validate();
  check_stops(stops, believed);
  const std::vector<HandEyeView> views = views_in(stops, believed, believed);
  CellCalibrationResult out;
  out.mount = options.mount;
  out.cell = believed;
  out.start = calibrate_hand_eye(views, believed.camera, hand_eye_options(options));
  out.views = out.start.views;
  out.fit = out.start.fit;
  if (!out.start.fit.usable() && !hand_eye::only_undecided(out.start)) return out;
  CellEstimation estimation{.input = {stops, believed, options, {}},
                            .start = out.start,
                            .weights = std::vector<double>(stops.size(), 1.0),
                            .sigmas = cell_sigmas(out.start, options)};
  const std::optional<kinematics::DhChain> arm =
      believed.arm.joints.empty() ? std::nullopt : std::optional(believed.arm);
  if (!scan.views.empty()) {
    out.scanner_start = calibrate_scanner(scan.views, scan.targets, scan.options, arm);
    if (!out.scanner_start.fit.usable()) {
      out.fit = out.scanner_start.fit;
      return out;
    }
    estimation.input.scan.emplace(scan_input(scan, out.scanner_start, arm));
  }
  const auto rival = fit::pipeline::run(estimation);
  write_cell_result(estimation, out);
  out.views = estimation.judged.views;
  for (std::size_t i = 0; i < out.views.size(); ++i) {
    if (out.views[i].weight == 0 && !out.views[i].outlier) continue;  // it gives no pose of the target
    out.views[i].outlier = estimation.weights[i] == 0;
    out.views[i].weight = estimation.weights[i];
  }
  if (rival)
    out.second = fit::pipeline::second_minimum(out.T_mount_camera, rival->at.T_mount_camera, rival->best_cost,
                                               rival->cost, out.covariance_dof);
  fit::pipeline::refuse_undecided(out.second, "two poses of the camera explain the views",
                                  "take more, from more directions", out.fit);
  return out;
}

std::vector<CellHeldOutView> evaluate_cell(std::span<const CellStop> stops, const CellGeometry& believed,
                                           const CellCalibrationOptions& options, int folds) {
  options.validate();
  check_stops(stops, believed);
  require(folds >= 2, "folds must be at least 2");
  require(stops.size() >= 6, "evaluate_cell needs at least six stops, found " + std::to_string(stops.size()));
  std::vector<CellHeldOutView> out(stops.size());
  const auto parts = std::min(static_cast<std::size_t>(folds), stops.size() / 2);
  for (std::size_t fold = 0; fold < parts; ++fold) {
    std::vector<CellStop> rest, left_out;
    std::vector<std::size_t> index;
    for (std::size_t i = 0; i < stops.size(); ++i) {
      (i % parts == fold ? left_out : rest).push_back(stops[i]);
      if (i % parts == fold) index.push_back(i);
    }
    const CellCalibrationResult found = calibrate_cell(rest, believed, options);
    if (!found.fit.usable()) continue;
    const std::vector<HandEyeView> before = views_in(left_out, believed, believed),
                                   after = views_in(left_out, believed, found.cell);
    for (std::size_t k = 0; k < index.size(); ++k)
      out[index[k]] = {
          .name = left_out[k].view.view.name,
          .rms_px = rms_of_view(after[k], options.mount, found.T_mount_camera, found.T_fixed_target, found.cell.camera),
          .separate_rms_px = rms_of_view(before[k], options.mount, found.start.T_mount_camera,
                                         found.start.T_fixed_target, believed.camera)};
  }
  std::erase_if(out, [](const CellHeldOutView& view) { return view.rms_px == 0; });
  return out;
}

}  // namespace kr5::calibration
