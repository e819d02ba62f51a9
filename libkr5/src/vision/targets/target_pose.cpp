// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/vision/target_pose.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <Eigen/Cholesky>

#include <kr5/core/error.hpp>
#include <kr5/geometry/resection.hpp>
#include <kr5/geometry/target.hpp>
#include <kr5/uncertainty/confidence.hpp>

namespace kr5::vision {
namespace {

TargetPose degenerate(const std::string& why) {
  TargetPose pose;
  pose.fit.message = why;
  return pose;
}

/// Logarithm of the odds of the second optimum against the first.
double log_odds(double first, double second, double dof, double sigma) {
  if (sigma > 0) return (first - second) / (2 * sigma * sigma);
  constexpr double tiny = 1e-18;  // [px^2] below it two perfect fits are the same
  return 0.5 * dof * std::log((first + tiny) / (second + tiny));
}

/// Options that say of the points of a view what their detection does.
TargetPoseOptions options_of(const Eigen::VectorXd& sigma, double correlation) {
  constexpr Eigen::Index telling_points = 6;
  TargetPoseOptions out{.correlation = correlation};
  if (sigma.size() > 0 && sigma.size() < telling_points) out.sigma_pixel = std::sqrt(sigma.cwiseAbs2().mean());
  return out;
}

}  // namespace

void TargetPoseOptions::validate() const {
  require(std::isfinite(sigma_pixel) && sigma_pixel >= 0, "sigma_pixel must not be negative [px]; 0 means estimated");
  require(std::isfinite(correlation) && correlation >= 1, "correlation must be at least 1 [-]");
  require(ambiguous_from > 0 && ambiguous_from <= 0.5, "ambiguous_from must lie between 0 and 0.5");
  ResectionOptions{.max_iterations = max_iterations, .huber = huber}.validate();
}

TargetPose estimate_target_pose(const View& view, const Pinhole& camera, const TargetPoseOptions& options) {
  options.validate();
  camera.validate();
  require(view.points.cols() == view.pixels.cols(), "view: points and pixels must have the same number of columns");
  require(view.points.allFinite() && view.pixels.allFinite(), "view: points and pixels must be finite");
  if (view.points.cols() < 4)
    return degenerate("a pose needs at least four points, the view has " + std::to_string(view.points.cols()));
  const std::vector<Resection> found =
      resect(view.points, view.pixels, camera, {.max_iterations = options.max_iterations, .huber = options.huber});
  if (found.empty()) return degenerate("the points lie on a line, or no pose puts them in front of the camera");
  const Resection& best = found.front();
  const double dof = 2.0 * static_cast<double>(view.points.cols()) - 6.0;
  TargetPose pose;
  pose.T_camera_target = best.T_camera_points;
  pose.rms_px = best.rms_px;
  pose.sigma_pixel = options.sigma_pixel > 0 ? options.sigma_pixel : std::sqrt(best.cost / dof);
  const Eigen::LDLT<Matrix6> information(best.information);
  if (!(information.rcond() > 1e-14)) return degenerate("the points do not determine the pose");
  pose.covariance_dof = options.sigma_pixel > 0 ? uncertainty::known_noise : dof;
  const double variance = options.correlation * pose.sigma_pixel * pose.sigma_pixel;
  pose.covariance =
      uncertainty::covariance_inflation(6, pose.covariance_dof) * variance * information.solve(Matrix6::Identity());
  pose.covariance = (0.5 * (pose.covariance + pose.covariance.transpose())).eval();
  if (found.size() > 1) {
    pose.T_camera_target_second = found[1].T_camera_points;
    pose.error_ratio = std::max(found[1].rms_px, 1e-12) / std::max(best.rms_px, 1e-12);
    const double odds = log_odds(best.cost, found[1].cost, dof, options.sigma_pixel) / options.correlation;
    pose.second_probability = 1 / (1 + std::exp(-odds));
    pose.ambiguous = pose.second_probability >= options.ambiguous_from;
  }
  pose.fit.status = FitStatus::Converged;
  pose.fit.final_rms = pose.sigma_pixel > 0 ? std::sqrt(best.cost / dof) / pose.sigma_pixel : 0.0;
  pose.fit.message = pose.ambiguous ? "two poses explain the view; move the camera nearer, or more to the side"
                                    : "one pose explains the view";
  return pose;
}

TargetPose estimate_target_pose(const Detection& detection, const Pinhole& camera) {
  return estimate_target_pose(detection.view, camera, options_of(detection.sigma, detection.correlation));
}

TargetPose estimate_tag_pose(const TagDetection& tag, double size, const Pinhole& camera) {
  return estimate_target_pose(tag_view(tag, size), camera, options_of(tag.sigma, tag.correlation));
}

View tag_view(const TagDetection& tag, double size) {
  require(size > 0 && std::isfinite(size), "size must be positive [m]");
  View out;
  out.name = tag.family + " " + std::to_string(tag.id);
  out.points = square_corners(size);
  out.pixels = tag.corners;
  for (int k = 0; k < 4; ++k) out.ids.push_back(4 * tag.id + k);
  return out;
}

}  // namespace kr5::vision
