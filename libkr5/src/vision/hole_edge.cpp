// SPDX-License-Identifier: BSD-3-Clause
#include "vision/hole_edge.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Cholesky>

namespace kr5::vision {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double centre_error = 0.01, radius_error = 0.015;  // [px] measured on rendered bores without noise
constexpr double step_px = 0.5;                              // between samples along a radius

/// Grey between the pixels; NaN outside the image.
double grey_at(ImageView image, const Vector2d& pixel) {
  if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < image.width - 1 && pixel.y() < image.height - 1)) return NAN;
  const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
  const double a = pixel.x() - x, b = pixel.y() - y;
  return (1 - b) * ((1 - a) * image.at(x, y) + a * image.at(x + 1, y)) +
         b * ((1 - a) * image.at(x, y + 1) + a * image.at(x + 1, y + 1));
}

/// Where along a radius it becomes bright most steeply, in steps from the first sample; NaN without a clear edge.
double steepest(const std::vector<double>& grey, double min_contrast) {
  constexpr int reach = 3;  // [steps] half width of the derivative, about that of a sharp edge: least noise
  const int count = static_cast<int>(grey.size());
  std::vector<double> slope(grey.size(), 0.0);
  for (int i = reach; i < count - reach; ++i)
    for (int k = 1; k <= reach; ++k) slope[i] += (grey[i + k] - grey[i - k]) / reach;
  const int best = static_cast<int>(std::max_element(slope.begin(), slope.end()) - slope.begin());
  if (!(slope[best] > min_contrast) || best <= reach || best >= count - reach - 1) return NAN;
  const double before = slope[best - 1], after = slope[best + 1], bend = before + after - 2 * slope[best];
  return bend < 0 ? best + 0.5 * (before - after) / bend : best;
}

struct Edges {
  std::vector<Vector2d> points;  ///< On the plane [m].
  int places = 0;
};

Edges find_edges(const PlaneView& view, const PlaneCircle& guess, double window, double min_contrast) {
  const double pixel = view.pixel_at(guess.centre), step = step_px * pixel;
  const double first = guess.radius * (1 - window) - 4 * step, last = guess.radius * (1 + window) + 4 * step;
  Edges out;
  // Neighbouring places share pixels and hence noise; two pixels apart they hardly do.
  out.places = std::clamp(static_cast<int>(std::numbers::pi * guess.radius / pixel), 24, 240);
  for (int k = 0; k < out.places; ++k) {
    const double angle = 2 * std::numbers::pi * k / out.places;
    const Vector2d along(std::cos(angle), std::sin(angle));
    std::vector<double> grey;
    for (double r = first; r <= last; r += step)
      grey.push_back(grey_at(view.image, view.camera.project(view.in_camera(guess.centre + r * along))));
    const double at = steepest(grey, min_contrast);
    if (std::isfinite(at)) out.points.push_back(guess.centre + (first + at * step) * along);
  }
  return out;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Circle of least robust distance to the points; `scale` of a distance comes from their scatter.
CircleEdge fit_circle(const std::vector<Vector2d>& points, PlaneCircle circle) {
  CircleEdge out;
  double scale = 0.0;
  Eigen::Matrix3d A;
  for (int i = 0; i < 12; ++i) {
    std::vector<double> size;
    for (const Vector2d& p : points) size.push_back(std::abs((p - circle.centre).norm() - circle.radius));
    scale = std::max(1.4826 * median(size), 1e-9);
    A.setZero();
    Vector3d g = Vector3d::Zero();
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Vector2d d = points[k] - circle.centre;
      const double weight = size[k] > 3 * scale ? std::pow(3 * scale / size[k], 2) : 1.0;
      const Vector3d J(-d.x() / d.norm(), -d.y() / d.norm(), -1.0);
      A += weight * J * J.transpose();
      g += weight * (d.norm() - circle.radius) * J;
    }
    const Vector3d change = -A.ldlt().solve(g);
    if (!change.allFinite()) return out;
    circle.centre += change.head<2>(), circle.radius += change.z();
    if (change.norm() < 1e-9) break;
  }
  out.circle = circle;
  out.covariance = scale * scale * A.inverse();
  for (const Vector2d& p : points) out.edges += std::abs((p - circle.centre).norm() - circle.radius) < 4 * scale;
  out.rms_px = scale;  // [m] yet
  return out;
}

}  // namespace

bool PlaneView::shows(const PlaneCircle& circle) const {
  constexpr int places = 32;
  for (int k = 0; k < places; ++k) {
    const double angle = 2 * std::numbers::pi * k / places;
    const Vector3d p = in_camera(circle.centre + 1.1 * circle.radius * Vector2d(std::cos(angle), std::sin(angle)));
    if (p.z() <= 0 || !std::isfinite(grey_at(image, camera.project(p)))) return false;
  }
  return true;
}

std::optional<CircleEdge> measure_circle(const PlaneView& view, const PlaneCircle& guess, double min_contrast) {
  CircleEdge found;
  found.circle = guess;
  for (const double window : {0.2, 0.1}) {  // about the guess, then about what was found
    const PlaneCircle from = found.circle;
    const Edges edges = find_edges(view, from, window, min_contrast);
    if (edges.points.size() < 8) return std::nullopt;
    found = fit_circle(edges.points, from);
    found.places = edges.places;
    const bool near = found.edges >= 8 && (found.circle.centre - from.centre).norm() < 0.25 * from.radius &&
                      std::abs(found.circle.radius - from.radius) < 0.25 * from.radius;
    if (!near) return std::nullopt;
  }
  const double pixel = view.pixel_at(found.circle.centre);
  found.rms_px /= pixel;
  const Vector3d left = pixel * Vector3d(centre_error, centre_error, radius_error);
  found.covariance += left.cwiseAbs2().asDiagonal();
  return found;
}

}  // namespace kr5::vision
