// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/cell_calibration/cell_estimation.hpp"

#include <algorithm>
#include <map>

#include <kr5/fit/variance_component.hpp>
#include <kr5/geometry/resection.hpp>

#include "calibration/hand_eye/start.hpp"

namespace kr5::calibration::cell_calibration {
namespace {

constexpr double sound_point = 0.5;  // weight of a point in the pose of its view, below which it has no part
constexpr int noise_rounds = 30;

/// Points that take part: of views that agree with the others, those that agree with their view.
std::vector<std::vector<int>> sound_points(std::span<const HandEyeView> views, const std::vector<double>& weights,
                                           const Pinhole& camera) {
  std::vector<std::vector<int>> out(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (weights[i] == 0) continue;
    const auto poses = resect(views[i].view.points, views[i].view.pixels, camera);
    if (poses.empty()) continue;
    for (Eigen::Index k = 0; k < poses.front().weights.size(); ++k)
      if (poses.front().weights[k] >= sound_point) out[i].push_back(static_cast<int>(k));
    if (out[i].size() < 4) out[i].clear();
  }
  return out;
}

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

}  // namespace

HandEyeOptions hand_eye_options(const CellCalibrationOptions& options) {
  return {.mount = options.mount,
          .sigma_pixel = options.sigma_pixel,
          .sigma_robot_position = options.sigma_robot_position,
          .sigma_robot_rotation = options.sigma_robot_rotation,
          .min_rotation = options.min_rotation,
          .outlier_false_alarm = options.outlier_false_alarm,
          .max_iterations = options.max_iterations};
}

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

CellSigmas cell_sigmas(const HandEyeResult& start, const CellCalibrationOptions& options) {
  CellSigmas out{
      .pixel = start.sigma_pixel, .position = start.sigma_robot_position, .rotation = start.sigma_robot_rotation};
  if (options.tolerance_length > 0) out.length = options.tolerance_length;
  if (options.tolerance_angle > 0) out.angle = options.tolerance_angle;
  return out;
}

std::string open_directions(const fit::Solution& result) {
  std::string out;
  for (const fit::UnidentifiableDirection& direction : result.unidentifiable) {
    if (direction.involves("arm")) continue;
    out += (out.empty() ? "not determined: " : "; ") + direction.text;
  }
  return out;
}

/// Where another pose of the camera is near in the cost, what is free here may speak for it.
std::vector<HandEyeResult> CellEstimation::starts() const {
  std::vector<HandEyeResult> out = {start};
  if (!start.second) return out;
  HandEyeOptions there = hand_eye_options(input.options);
  there.start = start.second->T;
  out.push_back(calibrate_hand_eye(views(), input.believed.camera, there));
  return out;
}

void CellEstimation::begin(const HandEyeResult& from) {
  problem.reset();
  start = judged = from;
  for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = from.views[i].outlier ? 0.0 : 1.0;
  sigmas = cell_sigmas(from, input.options);
}

void CellEstimation::find_noise() {
  input.points = sound_points(views(), weights, cell().camera);
  for (int round = 0; round < noise_rounds; ++round) {
    CellProblem next(input, sigmas, start.T_mount_camera, start.T_fixed_target);
    if (problem) next.begin_at(*problem);
    problem.emplace(std::move(next));
    result = problem->fit.solve({.max_iterations = input.options.max_iterations});
    iterations += result.fit.iterations;
    if (!result.fit.usable() || !update_sigmas()) return;
  }
}

std::vector<double> CellEstimation::probabilities() {
  if (!result.fit.usable() || !open_directions(result).empty()) return weights;  // no cell by which to judge
  HandEyeOptions with_cell = hand_eye_options(input.options);
  with_cell.start = problem->fit.pose(problem->mount);
  with_cell.sigma_pixel = sigmas.pixel;
  with_cell.sigma_robot_position = sigmas.position;
  with_cell.sigma_robot_rotation = sigmas.rotation;
  judged = calibrate_hand_eye(views(), cell().camera, with_cell);
  std::vector<double> out;
  for (const HandEyeViewReport& view : judged.views) out.push_back(view.outlier ? 0.0 : 1.0);
  return out;
}

HandEyeResult CellEstimation::place() const {
  HandEyeResult out = judged;
  out.T_mount_camera = problem->fit.pose(problem->mount);
  out.T_fixed_target = problem->fit.pose(problem->target);
  return out;
}

/// All stops, robust, with the noise that was found.
fit::pipeline::Minimum<HandEyeResult> CellEstimation::revisit(HandEyeResult from) const {
  CellInput all = input;
  all.points = sound_points(views(), std::vector<double>(weights.size(), 1.0), cell().camera);
  CellProblem there(all, sigmas, from.T_mount_camera, from.T_fixed_target);
  const double cost =
      there.fit.solve({.max_iterations = input.options.max_iterations, .loss = 2.0, .uncertainty = false}).cost;
  from.T_mount_camera = there.fit.pose(there.mount), from.T_fixed_target = there.fit.pose(there.target);
  return {from, cost};
}

bool CellEstimation::same(const HandEyeResult& one, const HandEyeResult& other) const {
  return hand_eye::same_poses({one.T_mount_camera, one.T_fixed_target}, {other.T_mount_camera, other.T_fixed_target},
                              hand_eye::usual_reach(views()));
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

}  // namespace kr5::calibration::cell_calibration
