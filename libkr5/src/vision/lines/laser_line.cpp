// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/vision/laser_line.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>

#include "vision/cv_view.hpp"

namespace kr5::vision {
namespace {

using Eigen::Index;
using Eigen::Matrix2Xd;
using Eigen::Matrix3Xd;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double unseen = std::numeric_limits<double>::quiet_NaN();
constexpr Index fewest_points = 5;
constexpr std::size_t fewest_greys = 9;  // across the line, inside the image
constexpr double least_deviation = 1.0;  // of greys, which are whole numbers
constexpr double wide_step = 2.0;        // between neighbours, over the median, from which the line is broken
constexpr double spot_level = 0.5;       // of the contrast, from which a local maximum is the line
constexpr double ground_level = 0.2;     // of the contrast, below which greys do not count
constexpr int half_spot = 4;             // [px]

/// Points that a camera sees, with their pixels.
struct ProjectedPoints {
  Matrix3Xd points;  // in the scanner
  Matrix2Xd pixels;
};

ProjectedPoints project_into(const ImageView& image, const Pinhole& camera, const Pose& T, const Matrix3Xd& points) {
  ProjectedPoints out{Matrix3Xd(3, points.cols()), Matrix2Xd(2, points.cols())};
  Index count = 0;
  for (const auto point : points.colwise()) {
    if (!point.allFinite()) continue;
    const Vector3d there = T * Vector3d(point);
    if (!camera.covers(there)) continue;
    const Vector2d pixel = camera.project(there);
    if (!(pixel.minCoeff() >= 0 && pixel.x() < image.width - 1 && pixel.y() < image.height - 1)) continue;
    out.points.col(count) = point;
    out.pixels.col(count++) = pixel;
  }
  out.points.conservativeResize(3, count);
  out.pixels.conservativeResize(2, count);
  return out;
}

/// Directions across a line through pixels.
Matrix2Xd normals_of(const Matrix2Xd& pixels) {
  Matrix2Xd out(2, pixels.cols());
  for (Index k = 0; k < pixels.cols(); ++k) {
    const Vector2d along = pixels.col(std::min(k + 1, pixels.cols() - 1)) - pixels.col(std::max<Index>(k - 1, 0));
    out.col(k) = Vector2d(-along.y(), along.x()) / std::max(along.norm(), 1e-9);
  }
  return out;
}

/// Whether the line has a direction at each point: it is not broken there.
std::vector<bool> unbroken(const Matrix2Xd& pixels) {
  const Index n = pixels.cols();
  std::vector<double> gaps;
  for (Index k = 0; k + 1 < n; ++k) gaps.push_back((pixels.col(k + 1) - pixels.col(k)).norm());
  const double usual = midpoint_median(gaps);
  std::vector<bool> out(static_cast<std::size_t>(n), true);
  for (Index k = 0; k + 1 < n; ++k) {
    if (gaps[static_cast<std::size_t>(k)] <= wide_step * usual) continue;
    for (Index i = std::max<Index>(0, k - 1); i < std::min(n, k + 3); ++i) out[static_cast<std::size_t>(i)] = false;
  }
  return out;
}

/// Grey levels at whole steps across a line.
struct GreysAcross {
  std::vector<double> steps, greys;
};

GreysAcross greys_across(const ImageView& image, const Vector2d& at, const Vector2d& normal, int reach) {
  GreysAcross out;
  for (int step = -reach; step <= reach; ++step) {
    const Vector2d place = at + step * normal;
    if (!(place.minCoeff() >= 0 && place.x() < image.width - 1 && place.y() < image.height - 1)) continue;
    const int x = static_cast<int>(place.x()), y = static_cast<int>(place.y());
    const double u = place.x() - x, v = place.y() - y;
    out.steps.push_back(step);
    out.greys.push_back((1 - v) * ((1 - u) * image.at(x, y) + u * image.at(x + 1, y)) +
                        v * ((1 - u) * image.at(x, y + 1) + u * image.at(x + 1, y + 1)));
  }
  return out;
}

/// Place among the greys of the local maximum nearest to the middle, of those at least so bright; -1 where there is
/// none.
int nearest_peak(const GreysAcross& across, double bright) {
  const std::vector<double>& g = across.greys;
  int best = -1;
  for (std::size_t k = 1; k + 1 < g.size(); ++k) {
    if (g[k] < bright || g[k] < g[k - 1] || g[k] < g[k + 1]) continue;
    if (best < 0 || std::abs(across.steps[k]) < std::abs(across.steps[static_cast<std::size_t>(best)]))
      best = static_cast<int>(k);
  }
  return best;
}

/// Where the nearest bright spot across the line lies; NaN where nothing stands out.
double line_offset(const GreysAcross& across, double min_contrast) {
  if (across.greys.size() < fewest_greys) return unseen;
  const double floor = midpoint_median(across.greys);
  std::vector<double> sizes;
  for (const double grey : across.greys) sizes.push_back(std::abs(grey - floor));
  const double contrast = *std::max_element(across.greys.begin(), across.greys.end()) - floor;
  if (contrast < min_contrast * std::max(mad_to_sigma * midpoint_median(sizes), least_deviation)) return unseen;
  const int peak = nearest_peak(across, floor + spot_level * contrast);
  if (peak < 0) return unseen;
  double sum = 0.0, weights = 0.0;
  for (std::size_t k = 0; k < across.greys.size(); ++k) {
    if (std::abs(across.steps[k] - across.steps[static_cast<std::size_t>(peak)]) > half_spot) continue;
    const double weight = std::max(across.greys[k] - floor - ground_level * contrast, 0.0);
    sum += weight * across.steps[k], weights += weight;
  }
  return sum / weights;
}

/// RMS standard deviation across the line by the covariance of the pose.
double expected_std(const Pinhole& camera, const UncertainPose& T, const ProjectedPoints& at,
                    const Matrix2Xd& normals) {
  double sum = 0.0;
  for (Index k = 0; k < normals.cols(); ++k) {
    const Vector3d point = at.points.col(k);
    Eigen::Matrix<double, 2, 3> by_point;
    camera.project(T.T * point, &by_point, nullptr);
    Eigen::Matrix<double, 3, 6> by_pose;
    by_pose << T.T.linear(), -T.T.linear() * skew(point);
    const Eigen::Matrix<double, 1, 6> J = normals.col(k).transpose() * by_point * by_pose;
    sum += (J * T.covariance * J.transpose()).value();
  }
  return std::sqrt(sum / static_cast<double>(normals.cols()));
}

void summarise(const LaserLineOptions& options, LaserLineComparison& out) {
  double sum = 0.0, squares = 0.0;
  for (const double d : out.distance)
    if (std::isfinite(d)) sum += d, squares += d * d, ++out.with_line;
  const auto points = static_cast<double>(out.distance.size());
  if (out.with_line < fewest_points || out.with_line < options.min_share * points) {
    out.fit.message = "the laser line is seen beside " + std::to_string(out.with_line) + " of " +
                      std::to_string(out.distance.size()) + " points";
    return;
  }
  out.rms_px = std::sqrt(squares / out.with_line);
  out.mean_px = sum / out.with_line;
  out.fit = {FitStatus::Converged, 1, 0.0, 0.0, "the laser line is seen"};
}

}  // namespace

void LaserLineOptions::validate() const {
  require(reach >= half_spot && reach <= 10000, "reach must lie between 4 and 10000 [px]");
  require(min_contrast > 0 && std::isfinite(min_contrast), "min_contrast must be positive [-]");
  require(min_share >= 0 && min_share <= 1, "min_share must lie between 0 and 1 [-]");
}

LaserLineComparison compare_laser_line(ImageView image, const Pinhole& camera, const UncertainPose& T_camera_scanner,
                                       const Matrix3Xd& points, const LaserLineOptions& options) {
  options.validate();
  camera.validate();
  require_image(image);
  require(image.width == camera.width && image.height == camera.height,
          "the image is " + std::to_string(image.width) + " x " + std::to_string(image.height) + " px, the camera " +
              std::to_string(camera.width) + " x " + std::to_string(camera.height));
  require(T_camera_scanner.T.matrix().allFinite() && is_covariance(T_camera_scanner.covariance),
          "T_camera_scanner must be finite, with a covariance");
  const ProjectedPoints at = project_into(image, camera, T_camera_scanner.T, points);
  LaserLineComparison out;
  if (at.pixels.cols() < fewest_points) {
    out.fit.message = "the profile lies outside the image: " + std::to_string(at.pixels.cols()) + " of " +
                      std::to_string(points.cols()) + " points are in it, expected at least " +
                      std::to_string(fewest_points);
    return out;
  }
  const Matrix2Xd normals = normals_of(at.pixels);
  const std::vector<bool> smooth = unbroken(at.pixels);
  out.projected = at.pixels;
  out.distance = Eigen::VectorXd::Constant(at.pixels.cols(), unseen);
  for (Index k = 0; k < at.pixels.cols(); ++k)
    if (smooth[static_cast<std::size_t>(k)])
      out.distance[k] =
          line_offset(greys_across(image, at.pixels.col(k), normals.col(k), options.reach), options.min_contrast);
  out.seen = out.projected + normals * out.distance.asDiagonal();
  out.expected_std = expected_std(camera, T_camera_scanner, at, normals);
  summarise(options, out);
  return out;
}

}  // namespace kr5::vision
