// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/cell_calibration/cell_problem.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <kr5/core/error.hpp>
#include <kr5/fit/measurements/pixels.hpp>

#include "calibration/parameters/arm_prior.hpp"

namespace kr5::calibration::cell_calibration {
namespace {

bool holds(const CellCalibrationOptions& options, const char* what) {
  return std::find(options.hold.begin(), options.hold.end(), what) != options.hold.end();
}

/// Points of a stop on one marker, in the frame of the marker, and their pixels.
struct MarkerView {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
};

template <int Rows>
Eigen::Matrix<double, Rows, Eigen::Dynamic> columns(const std::vector<Eigen::Matrix<double, Rows, 1>>& from) {
  Eigen::Matrix<double, Rows, Eigen::Dynamic> out(Rows, static_cast<Eigen::Index>(from.size()));
  for (std::size_t i = 0; i < from.size(); ++i) out.col(static_cast<Eigen::Index>(i)) = from[i];
  return out;
}

}  // namespace

CellProblem::CellProblem(const CellInput& input, const CellSigmas& sigmas, const Pose& T_mount_camera,
                         const Pose& T_fixed_target) {
  add_camera(input);
  mount = fit.add_pose("T_mount_camera", T_mount_camera);
  target = fit.add_pose("T_fixed_target", T_fixed_target);
  add_markers(input);
  add_arm(input, sigmas);
  if (input.scan) add_scan(*input.scan);
  for (const std::string& name : input.options.hold)
    if (name != "markers" && name != "arm")  // which there may be none of
      require(fit.hold(name), "hold: found '" + name +
                                  "', expected camera, markers, arm, or the name of a parameter such as camera.k1 or "
                                  "arm.joint2.a");
  for (std::size_t i = 0; i < input.stops.size(); ++i) add_stop(input, i, sigmas);
}

void CellProblem::add_camera(const CellInput& input) {
  camera = fit.add_camera("camera", input.believed.camera);
  if (holds(input.options, "camera")) return fit.hold(camera);
  const Pinhole::Parameters p = input.believed.camera.parameters();
  for (int k = 4; k < Pinhole::parameter_count; ++k)
    if (p[k] == 0) fit.hold(camera, k);
}

void CellProblem::add_markers(const CellInput& input) {
  if (input.believed.markers.empty()) return;
  const auto by_id = [](const MapMarker& a, const MapMarker& b) { return a.id < b.id; };
  const int reference = std::min_element(input.believed.markers.begin(), input.believed.markers.end(), by_id)->id;
  for (const MapMarker& marker : input.believed.markers) {
    const fit::FitBlock block = fit.add_pose("marker" + std::to_string(marker.id), marker.T_target_marker);
    if (marker.id == reference || holds(input.options, "markers")) fit.hold(block);
    markers[marker.id] = block;
  }
}

void CellProblem::add_arm(const CellInput& input, const CellSigmas& sigmas) {
  if (!input.has_arm()) return;
  arm = fit.add_arm("arm", input.believed.arm);
  parameters::free_arm(fit, arm, input.believed.arm, sigmas.length, sigmas.angle);
  if (holds(input.options, "arm")) fit.hold(arm);
}

void CellProblem::add_scan(const CellScanInput& scan) {
  scanner = scanner_problem::add_scanner(fit, arm, scan.input, scan.sigmas, scan.placement);
  for (std::size_t i = 0; i < scan.outlier.size(); ++i)
    if (scan.outlier[i]) fit.set_weight(scanner.observations[i], 0.0);
}

void CellProblem::add_stop(const CellInput& input, std::size_t i, const CellSigmas& sigmas) {
  const CellStop& stop = input.stops[i];
  errors.emplace_back(), observations.emplace_back();
  if (input.points[i].empty()) return;
  Vector6 prior;
  prior << Eigen::Vector3d::Constant(sigmas.position), Eigen::Vector3d::Constant(sigmas.rotation);
  errors[i] = fit.add_nuisance_pose("error of stop " + std::to_string(i));
  fit.set_prior(errors[i], prior);
  fit::PoseChain chain;
  chain.then_inverse(mount);
  if (input.options.mount == Mount::EyeInHand) {
    chain.then_inverse(errors[i]);
    input.has_arm() ? chain.then_inverse_arm(arm, stop.q) : chain.then(stop.view.T_base_flange.inverse());
  } else {
    input.has_arm() ? chain.then_arm(arm, stop.q) : chain.then(stop.view.T_base_flange);
    chain.then(errors[i]);
  }
  chain.then(target);
  std::map<int, MarkerView> seen;
  for (const int k : input.points[i]) {
    const int id = markers.empty() ? 0 : stop.view.view.ids[static_cast<std::size_t>(k)] / 4;
    const Eigen::Vector3d point = stop.view.view.points.col(k);
    seen[id].points.push_back(markers.empty() ? point : Eigen::Vector3d(fit.pose(markers[id]).inverse() * point));
    seen[id].pixels.push_back(stop.view.view.pixels.col(k));
  }
  const double sigma = sigmas.pixel * std::sqrt(stop.view.correlation);
  for (const auto& [id, view] : seen) {
    fit::PoseChain to_points = chain;
    if (!markers.empty()) to_points.then(markers[id]);
    observations[i].push_back(
        fit.add(fit::PixelMeasurement(to_points, camera, columns<3>(view.points), columns<2>(view.pixels), sigma)));
  }
}

void CellProblem::begin_at(const CellProblem& other) {
  const auto take = [&](fit::FitBlock mine, fit::FitBlock theirs) {
    if (mine.exists() && theirs.exists()) fit.begin_at(mine, other.fit.values(theirs));
  };
  take(camera, other.camera), take(mount, other.mount), take(target, other.target), take(arm, other.arm);
  if (scanner.scanner.exists()) scanner.begin_at(fit, other.scanner, other.fit);
  for (const auto& [id, marker] : markers) take(marker, other.markers.at(id));
  for (std::size_t i = 0; i < errors.size(); ++i) take(errors[i], other.errors[i]);
}

CellGeometry CellProblem::cell(const CellGeometry& believed) const {
  CellGeometry out = believed;
  out.camera = fit.camera(camera);
  for (MapMarker& marker : out.markers) marker.T_target_marker = fit.pose(markers.at(marker.id));
  if (arm.exists()) out.arm = fit.arm(arm);
  return out;
}

}  // namespace kr5::calibration::cell_calibration
