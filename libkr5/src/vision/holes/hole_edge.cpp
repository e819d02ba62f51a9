// SPDX-License-Identifier: BSD-3-Clause
#include "vision/holes/hole_edge.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <kr5/core/levenberg_marquardt.hpp>
#include <kr5/core/statistics.hpp>

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

/// Distances of edges from a circle, with a loss that grows only as the logarithm beyond `limit` scales; the scale
/// comes from their scatter.
class CircleProblem {
 public:
  CircleProblem(const std::vector<Vector2d>& points, const Vector3d& start) : points_(points) { set_scale(start); }

  NormalEquations<3> equations(const Vector3d& x) const {
    constexpr double limit = 3.0;
    NormalEquations<3> out;
    for (const Vector2d& point : points_) {
      const Vector2d d = point - x.head<2>();
      const double r = d.norm() - x.z(), ratio = std::abs(r) / (limit * scale_);
      out.add({-d.x() / d.norm(), -d.y() / d.norm(), -1.0}, r, ratio > 1 ? 1 / (ratio * ratio) : 1.0);
      if (ratio > 1) out.cost += 2 * std::pow(limit * scale_, 2) * std::log(ratio);
    }
    return out;
  }
  bool reweigh(const Vector3d& x, const NormalEquations<3>&) {
    const double before = scale_;
    set_scale(x);
    return scale_ != before;
  }
  double scale() const { return scale_; }

 private:
  void set_scale(const Vector3d& x) {
    std::vector<double> size;
    for (const Vector2d& p : points_) size.push_back(std::abs((p - x.head<2>()).norm() - x.z()));
    scale_ = std::max(mad_to_sigma * median(size), 1e-9);
  }

  const std::vector<Vector2d>& points_;
  double scale_ = 0.0;  ///< [m]
};

/// Circle of least robust distance to the points. Without edges when there is none.
CircleEdge fit_circle(const std::vector<Vector2d>& points, const PlaneCircle& start) {
  const Vector3d x(start.centre.x(), start.centre.y(), start.radius);
  CircleProblem problem(points, x);
  const auto found = levenberg_marquardt<3>(x, problem, {.max_iterations = 30});
  const auto covariance = found.equations.covariance(problem.scale() * problem.scale());
  CircleEdge out;
  if (!found.usable() || !covariance) return out;
  out.circle = {found.x.head<2>(), found.x.z()};
  out.covariance = *covariance;
  for (const Vector2d& p : points)
    out.edges += std::abs((p - out.circle.centre).norm() - out.circle.radius) < 4 * problem.scale();
  out.rms_px = problem.scale();  // [m] yet
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
