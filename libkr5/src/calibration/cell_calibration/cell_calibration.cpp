// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/cell_calibration.hpp>

#include <algorithm>
#include <cmath>
#include <set>

#include <Eigen/Dense>
#include <kr5/calibration/scanner_points.hpp>
#include <kr5/core/error.hpp>
#include <kr5/fit/variance_component.hpp>
#include <kr5/geometry/resection.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "calibration/cell_calibration/cell_problem.hpp"
#include "calibration/pipeline/parameter_report.hpp"
#include "calibration/scanner/scanner_start.hpp"

namespace kr5::calibration {
namespace {

using namespace cell_calibration;
using fit::VarianceComponent;

constexpr double sound_point = 0.5;  // weight of a point in the pose of its view, below which it has no part
constexpr int noise_rounds = 30;
constexpr int outlier_rounds = 4;

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

/// The stops as a cell of other geometry would have seen them: points by its map, robot poses by its arm.
std::vector<HandEyeView> views_in(std::span<const CellStop> stops, const CellGeometry& believed,
                                  const CellGeometry& cell) {
  std::map<int, Pose> moved;
  for (std::size_t m = 0; m < cell.markers.size(); ++m)
    moved[cell.markers[m].id] = cell.markers[m].T_target_marker * believed.markers[m].T_target_marker.inverse();
  std::vector<HandEyeView> out;
  for (const CellStop& stop : stops) {
    HandEyeView& view = out.emplace_back(stop.view);
    if (!cell.arm.joints.empty()) view.T_base_flange = cell.arm.flange(stop.q);
    for (Eigen::Index k = 0; k < view.view.points.cols() && !moved.empty(); ++k) {
      const int id = view.view.ids[static_cast<std::size_t>(k)] / 4;
      view.view.points.col(k) = moved.at(id) * Eigen::Vector3d(view.view.points.col(k));
    }
  }
  return out;
}

HandEyeOptions hand_eye_options(const CellCalibrationOptions& options) {
  return {.mount = options.mount,
          .sigma_pixel = options.sigma_pixel,
          .sigma_robot_position = options.sigma_robot_position,
          .sigma_robot_rotation = options.sigma_robot_rotation,
          .min_rotation = options.min_rotation,
          .outlier_false_alarm = options.outlier_false_alarm,
          .max_iterations = options.max_iterations};
}

/// Points that take part: of views that agree with the others, those that agree with their view.
std::vector<std::vector<int>> sound_points(std::span<const HandEyeView> views, const HandEyeResult& found,
                                           const Pinhole& camera) {
  std::vector<std::vector<int>> out(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (found.views[i].outlier || found.views[i].weight == 0) continue;
    const auto poses = resect(views[i].view.points, views[i].view.pixels, camera);
    if (poses.empty()) continue;
    for (Eigen::Index k = 0; k < poses.front().weights.size(); ++k)
      if (poses.front().weights[k] >= sound_point) out[i].push_back(static_cast<int>(k));
    if (out[i].size() < 4) out[i].clear();
  }
  return out;
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

/// The calibration while it goes on.
struct CellEstimation {
  CellInput input;
  Pose T_mount_camera, T_fixed_target;  // of the start
  CellSigmas sigmas;
  std::optional<CellProblem> problem = std::nullopt;
  fit::Solution result = {};
  double robot_dof = uncertainty::known_noise;
  int iterations = 0;

  void fit() {
    CellProblem next(input, sigmas, T_mount_camera, T_fixed_target);
    if (problem) next.begin_at(*problem);
    problem.emplace(std::move(next));
    result = problem->fit.solve({.max_iterations = input.options.max_iterations});
    iterations += result.fit.iterations;
  }
  bool update_sigmas();
  void settle() {
    for (int round = 0; round < noise_rounds; ++round) {
      fit();
      if (!result.fit.usable() || !update_sigmas()) return;
    }
  }
};

/// Free parameters of scanner and targets.
double scanner_parameters(const CellProblem& problem, const fit::Solution& solution) {
  double out = 0;
  std::vector<fit::FitBlock> blocks = {problem.scanner.scanner};
  blocks.insert(blocks.end(), problem.scanner.targets.begin(), problem.scanner.targets.end());
  blocks.insert(blocks.end(), problem.scanner.radii.begin(), problem.scanner.radii.end());
  for (const fit::FitBlock block : blocks) {
    if (!block.exists()) continue;
    for (const int place : solution.places(block)) out += place >= 0;
  }
  return out;
}

/// One round of restricted maximum likelihood; whether it goes on.
bool CellEstimation::update_sigmas() {
  const CellCalibrationOptions& o = input.options;
  fit::VarianceComponent position, rotation, length, angle, pixel;
  // Of all residuals, priors included, so many are not fitted; what the priors have of it is not the pixels'.
  pixel.redundancy = -static_cast<double>(result.coordinates.size());
  for (std::size_t i = 0; i < problem->errors.size(); ++i) {
    if (!problem->errors[i].exists()) continue;
    const Eigen::VectorXd change = problem->fit.change(problem->errors[i]),
                          share = result.prior_redundancy(problem->fit, problem->errors[i]);
    for (Eigen::Index k = 0; k < 6; ++k)
      (k < 3 ? position : rotation).add(change[k] / (k < 3 ? sigmas.position : sigmas.rotation), share[k]);
    for (const fit::FitMeasurement observation : problem->observations[i]) {
      const Eigen::VectorXd r = problem->fit.residuals(observation);
      pixel.squares += r.squaredNorm();
      pixel.redundancy += static_cast<double>(r.size());
    }
  }
  pixel.redundancy -= position.redundancy + rotation.redundancy;
  if (problem->arm.exists()) {
    const std::vector<int> places = result.places(problem->arm);
    const Eigen::VectorXd change = problem->fit.change(problem->arm),
                          share = result.prior_redundancy(problem->fit, problem->arm);
    for (std::size_t k = 0; k < places.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      const bool is_length = k % 5 == 0 || k % 5 == 2;
      if (places[k] < 0) continue;
      (is_length ? length : angle).add(change[at] / (is_length ? sigmas.length : sigmas.angle), share[at]);
      pixel.redundancy += 1 - share[at];
    }
  }
  // Profiles tell nothing of the pixels; their share of the parameters is not taken off them.
  if (problem->scanner.scanner.exists()) pixel.redundancy += scanner_parameters(*problem, result);
  // The data of one calibration cannot tell the robot's position and rotation noise apart better than the start did.
  const bool free_position = o.sigma_robot_position == 0, free_rotation = o.sigma_robot_rotation == 0;
  fit::VarianceComponent robot;
  if (free_position) robot.add(position);
  if (free_rotation) robot.add(rotation);
  robot_dof = free_position || free_rotation ? std::max(robot.redundancy, 1.0) : uncertainty::known_noise;
  bool moving = false;
  if (free_position) moving = robot.update(sigmas.position, 1e-7) || moving;
  if (free_rotation) moving = robot.update(sigmas.rotation, 1e-7) || moving;
  if (o.sigma_pixel == 0) moving = pixel.update(sigmas.pixel, 1e-5) || moving;
  if (o.tolerance_length == 0) moving = length.update(sigmas.length, 1e-6) || moving;
  if (o.tolerance_angle == 0) moving = angle.update(sigmas.angle, 1e-6) || moving;
  return moving;
}

/// Why the stops cannot tell the answer; empty when they can. What only the spread of the arm tells is told.
std::string open_directions(const fit::Solution& result) {
  std::string out;
  for (const fit::UnidentifiableDirection& direction : result.unidentifiable) {
    if (direction.involves("arm")) continue;
    out += (out.empty() ? "not determined: " : "; ") + direction.text;
  }
  return out;
}

/// Scanner on the flange and in the camera.
void write_scanner(const CellEstimation& estimation, CellCalibrationResult& out) {
  const CellProblem& problem = *estimation.problem;
  const Eigen::MatrixXd& C = estimation.result.covariance;
  const double inflation = uncertainty::covariance_inflation(6, out.scanner_start.dof);
  out.T_flange_scanner = problem.fit.pose(problem.scanner.scanner);
  out.covariance_scanner = inflation * pipeline::covariance_of_pose(estimation.result, problem.scanner.scanner, C);
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
      of_pose * pipeline::covariance_of_pose(estimation.result, problem.mount, estimation.result.covariance);
  out.covariance_target =
      of_pose * pipeline::covariance_of_pose(estimation.result, problem.target, estimation.result.covariance);
  const fit::FitBlock nominal[] = {problem.camera, problem.arm};
  std::vector<fit::FitBlock> others = {problem.mount, problem.target};
  for (const auto& [id, marker] : problem.markers) others.push_back(marker);
  if (problem.scanner.scanner.exists()) {
    write_scanner(estimation, out);
    others.push_back(problem.scanner.scanner);
    others.insert(others.end(), problem.scanner.targets.begin(), problem.scanner.targets.end());
    others.insert(others.end(), problem.scanner.radii.begin(), problem.scanner.radii.end());
  }
  pipeline::ParameterReport report =
      pipeline::report_parameters(problem.fit, estimation.result, nominal, others,
                                  pipeline::same_inflation(estimation.result, 1, out.covariance_dof));
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

std::vector<bool> outliers_of(const HandEyeResult& result) {
  std::vector<bool> out;
  for (const HandEyeViewReport& view : result.views) out.push_back(view.outlier);
  return out;
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
  const HandEyeOptions alone = hand_eye_options(options);
  std::vector<HandEyeView> views = views_in(stops, believed, believed);
  CellCalibrationResult out;
  out.mount = options.mount;
  out.cell = believed;
  out.start = calibrate_hand_eye(views, believed.camera, alone);
  out.views = out.start.views;
  out.fit = out.start.fit;
  if (!out.start.fit.usable()) return out;
  CellEstimation estimation{.input = {stops, believed, options, sound_points(views, out.start, believed.camera)},
                            .T_mount_camera = out.start.T_mount_camera,
                            .T_fixed_target = out.start.T_fixed_target,
                            .sigmas = {.pixel = out.start.sigma_pixel,
                                       .position = out.start.sigma_robot_position,
                                       .rotation = out.start.sigma_robot_rotation}};
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
  if (options.tolerance_length > 0) estimation.sigmas.length = options.tolerance_length;
  if (options.tolerance_angle > 0) estimation.sigmas.angle = options.tolerance_angle;
  std::vector<bool> outliers = outliers_of(out.start);
  for (int round = 0; round < outlier_rounds; ++round) {
    estimation.settle();
    write_cell_result(estimation, out);
    if (!out.fit.usable()) return out;
    views = views_in(stops, believed, out.cell);
    HandEyeOptions again = alone;
    again.start = out.T_mount_camera;
    again.sigma_pixel = out.sigma_pixel;
    again.sigma_robot_position = out.sigma_robot_position;
    again.sigma_robot_rotation = out.sigma_robot_rotation;
    const HandEyeResult judged = calibrate_hand_eye(views, out.cell.camera, again);
    out.views = judged.views;
    if (outliers_of(judged) == outliers) break;
    outliers = outliers_of(judged);
    estimation.input.points = sound_points(views, judged, out.cell.camera);
  }
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
