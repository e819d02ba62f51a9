// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/picking/cylinder_fit.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Eigenvalues>

#include <kr5/core/error.hpp>
#include <kr5/core/levenberg_marquardt.hpp>
#include <kr5/core/statistics.hpp>

#include "axes.hpp"

namespace kr5::picking {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector2d;
using Eigen::Vector3d;

void CylinderFitOptions::validate() const {
  require(radius >= 0 && std::isfinite(radius), "radius must not be negative [m]");
  require(sigma_radius >= 0 && std::isfinite(sigma_radius), "sigma_radius must not be negative [m]");
  require(radius > 0 || sigma_radius == 0, "sigma_radius belongs to a radius, which is missing");
  require(noise >= 0 && std::isfinite(noise), "noise must not be negative [m]");
  require(max_rounds >= 1, "max_rounds must be at least 1");
  require(outlier_limit >= 2 && std::isfinite(outlier_limit), "outlier_limit must be 2 or more [-]");
  require(accepted_std > 0 && std::isfinite(accepted_std), "accepted_std must be positive [-]");
}

namespace {

struct Side {
  Matrix3d frame = Matrix3d::Identity();  ///< Third column: the axis.
  Vector3d point = Vector3d::Zero();
  double radius = 0.0;
};

/// Points of a side against a cylinder: moves across the axis, tilts of it, the radius.
struct SideProblem {
  const Matrix3Xd& points;
  const std::vector<Index>& used;
  const CylinderFitOptions& options;
  double noise = 0.0;  ///< Of the bias that the curvature makes, and of the weight of the radius known beforehand.

  NormalEquations<5> equations(const Side& at) const {
    NormalEquations<5> out;
    const Matrix3d R = at.frame.transpose();
    for (const Index i : used) {
      const Vector3d q = R * (points.col(i) - at.point);
      const double rho = q.head<2>().norm();
      if (rho == 0) continue;
      const Vector2d n = q.head<2>() / rho;
      const double residual = rho - at.radius - noise * noise / (2 * at.radius);
      out.add({-n.x(), -n.y(), q.z() * n.y(), -q.z() * n.x(), -1.0}, residual);
    }
    if (options.radius > 0) {
      if (options.sigma_radius > 0 && noise > 0)
        out.add({0, 0, 0, 0, 1}, at.radius - options.radius, std::pow(noise / options.sigma_radius, 2));
      else
        out.hold(4);
    }
    return out;
  }
  Side moved(const Side& from, const Eigen::Matrix<double, 5, 1>& step) const {
    Side out = from;
    out.point += from.frame.leftCols<2>() * step.head<2>();
    out.frame = from.frame * exp_rotation({step[2], step[3], 0});
    out.radius = std::max(from.radius + step[4], 0.05 * from.radius);
    return out;
  }
};

/// Circle through points of the plane, by its algebraic distances.
struct Circle {
  Vector2d centre = Vector2d::Zero();
  double radius = 0.0;
};
Circle algebraic_circle(const Eigen::Matrix2Xd& points) {
  const Vector2d mean = points.rowwise().mean();
  Matrix3d A = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  for (Index i = 0; i < points.cols(); ++i) {
    const Vector2d p = points.col(i) - mean;
    const Vector3d row(p.x(), p.y(), 1);
    A += row * row.transpose();
    b += row * p.squaredNorm();
  }
  const Vector3d x = A.ldlt().solve(b);
  const Vector2d centre = x.head<2>() / 2;
  return {mean + centre, std::sqrt(std::max(x[2] + centre.squaredNorm(), 0.0))};
}

/// Cylinder about a direction: the circle of the points seen along it, of the given radius if that is known.
Side start_about(const Matrix3Xd& points, const Vector3d& axis, double radius) {
  Side out;
  out.frame = axes_about(axis);
  const Eigen::Matrix2Xd flat = out.frame.leftCols<2>().transpose() * points;
  const Circle circle = algebraic_circle(flat);
  const Vector2d mean = flat.rowwise().mean();
  out.radius = radius > 0 ? radius : circle.radius;
  Vector2d centre = circle.centre;
  if (radius > 0) {  // an arc tells the direction of the centre better than its distance
    const Vector2d inwards = (circle.centre - mean).normalized();
    centre = mean + inwards * std::max((circle.centre - mean).norm() + radius - circle.radius, 0.3 * radius);
  }
  out.point = out.frame.leftCols<2>() * centre + axis * axis.dot(points.rowwise().mean());
  return out;
}

/// RMS distance of points from the surface.
double rms_distance(const Matrix3Xd& points, const Side& side) {
  const Eigen::Matrix2Xd flat = side.frame.leftCols<2>().transpose() * (points.colwise() - side.point);
  return std::sqrt((flat.colwise().norm().array() - side.radius).square().mean());
}

/// The start about the axis given, or the one that fits best of directions all over the sphere.
Side best_start(const Matrix3Xd& points, const std::optional<Vector3d>& axis, double radius) {
  if (axis) return start_about(points, axis->normalized(), radius);
  Side best;
  double least = std::numeric_limits<double>::infinity();
  const int rings = 8;  // directions over a half sphere, about 12 degrees apart
  for (int ring = 0; ring < rings; ++ring) {
    const double polar = std::numbers::pi / 2 * (ring + 0.5) / rings;
    const int count = std::max(1, static_cast<int>(std::lround(2 * std::numbers::pi * std::sin(polar) / 0.2)));
    for (int k = 0; k < count; ++k) {
      const double azimuth = 2 * std::numbers::pi * k / count;
      const Side start = start_about(
          points, {std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth), std::cos(polar)}, radius);
      const double rms = rms_distance(points, start);
      if (std::isfinite(rms) && rms < least) {
        least = rms;
        best = start;
      }
    }
  }
  return best;
}

/// Residuals, the bias of the noise taken out.
std::vector<double> residuals_of(const Matrix3Xd& points, const Side& side, double noise) {
  std::vector<double> out(static_cast<std::size_t>(points.cols()));
  for (Index i = 0; i < points.cols(); ++i)
    out[static_cast<std::size_t>(i)] = (side.frame.leftCols<2>().transpose() * (points.col(i) - side.point)).norm() -
                                       side.radius - noise * noise / (2 * side.radius);
  return out;
}

double robust_sigma(const std::vector<double>& residuals) {
  std::vector<double> sizes(residuals.size());
  std::transform(residuals.begin(), residuals.end(), sizes.begin(), [](double r) { return std::abs(r); });
  return mad_to_sigma * median(std::move(sizes));
}

/// Angle about the axis that the points cover: a turn less the widest gap.
double covered_arc(const Matrix3Xd& points, const std::vector<Index>& used, const Side& side) {
  std::vector<double> angles;
  for (const Index i : used) {
    const Vector2d q = side.frame.leftCols<2>().transpose() * (points.col(i) - side.point);
    angles.push_back(std::atan2(q.y(), q.x()));
  }
  std::sort(angles.begin(), angles.end());
  double gap = angles.front() + 2 * std::numbers::pi - angles.back();
  for (std::size_t i = 1; i < angles.size(); ++i) gap = std::max(gap, angles[i] - angles[i - 1]);
  return 2 * std::numbers::pi - gap;
}

/// A side of a cylinder, the points that agree with it, and their noise.
struct SettledSide {
  Side side;
  std::vector<Index> used;
  double noise = 0.0;  ///< Of the points that agree, as estimated [m].
  int iterations = 0;
  std::string problem;  ///< Why there is none; empty: there is one.
};

std::vector<Index> points_within(const std::vector<double>& residuals, double limit) {
  std::vector<Index> out;
  for (std::size_t i = 0; i < residuals.size(); ++i)
    if (std::abs(residuals[i]) <= limit + 1e-12) out.push_back(static_cast<Index>(i));
  return out;
}

double estimated_noise(const std::vector<double>& residuals, const std::vector<Index>& used, double parameters) {
  double sum = 0;
  for (const Index i : used) sum += std::pow(residuals[static_cast<std::size_t>(i)], 2);
  return std::sqrt(sum / std::max(1.0, static_cast<double>(used.size()) - parameters));
}

/// Fit, noise and points that agree in turn, until none of them changes.
SettledSide settle(const Matrix3Xd& points, const CylinderFitOptions& options, const Side& start) {
  SettledSide out{.side = start, .used = std::vector<Index>(static_cast<std::size_t>(points.cols())), .problem = {}};
  std::iota(out.used.begin(), out.used.end(), Index(0));
  double noise = options.noise;
  for (int round = 0; round < options.max_rounds; ++round) {
    const auto fit = levenberg_marquardt<5>(out.side, SideProblem{points, out.used, options, noise});
    out.side = fit.x;
    if (!fit.usable() || !out.side.point.allFinite()) {
      out.problem = "the fit did not converge; are these points of a cylinder?";
      return out;
    }
    out.iterations += fit.iterations;
    const std::vector<double> residuals = residuals_of(points, out.side, noise);
    const double sigma = options.noise > 0 ? options.noise : robust_sigma(residuals);
    std::vector<Index> next = points_within(residuals, options.outlier_limit * sigma);
    if (next.size() < 8) {
      out.problem = "fewer than 8 points agree with one cylinder";
      return out;
    }
    out.noise = estimated_noise(residuals, next, options.radius > 0 ? 4.0 : 5.0);
    const bool settled = next == out.used && (options.noise > 0 || std::abs(out.noise - noise) < 0.01 * out.noise);
    out.used = std::move(next);
    if (options.noise == 0) noise = out.noise;
    if (settled) break;
  }
  return out;
}

/// Covariance of the parameters; nothing where the points do not determine them.
std::optional<Eigen::Matrix<double, 5, 5>> covariance_of(const Matrix3Xd& points, const CylinderFitOptions& options,
                                                         const SettledSide& found, double sigma) {
  NormalEquations<5> end = SideProblem{points, found.used, options, sigma}.equations(found.side);
  const bool held = options.radius > 0 && options.sigma_radius == 0;
  if (held) end.information(4, 4) = 1;
  auto covariance = end.covariance(std::max(sigma * sigma, 1e-24));
  if (covariance && held) {
    covariance->row(4).setZero();
    covariance->col(4).setZero();
  }
  return covariance;
}

/// What the points show of the side: how long it is, and how far about the axis.
void write_extent(const Matrix3Xd& points, const SettledSide& found, CylinderFit& out) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Index i : found.used) {
    const double t = out.axis.dot(points.col(i) - found.side.point);
    low = std::min(low, t), high = std::max(high, t);
  }
  out.length = high - low;
  out.arc = covered_arc(points, found.used, found.side);
  out.points = static_cast<int>(found.used.size());
  out.outliers = static_cast<int>(points.cols()) - out.points;
}

CylinderFit refused(CylinderFit out, std::string message) {
  out.fit.status = FitStatus::Degenerate;
  out.fit.message = std::move(message);
  return out;
}

}  // namespace

CylinderFit fit_cylinder(const Matrix3Xd& points, const CylinderFitOptions& options,
                         const std::optional<Vector3d>& axis) {
  options.validate();
  require(points.allFinite(), "points: a coordinate is not finite; leave out what was not measured");
  require(!axis || (axis->allFinite() && axis->norm() > 0), "axis must be a direction");
  CylinderFit out;
  if (points.cols() < 8) return refused(out, "too few points: 8 are needed, found " + std::to_string(points.cols()));
  const Side start = best_start(points, axis, options.radius);
  if (!(start.radius > 0) || !start.point.allFinite()) return refused(out, "the points lie in a plane or on a line");
  const SettledSide found = settle(points, options, start);
  out.fit.iterations = found.iterations;
  if (!found.problem.empty()) return refused(out, found.problem);
  out.noise = found.noise;
  const double sigma = options.noise > 0 ? options.noise : out.noise;
  const auto covariance = covariance_of(points, options, found, sigma);
  if (!covariance) return refused(out, "the points lie in a plane or cover too little of the surface");
  out.point = found.side.point;
  out.axis = found.side.frame.col(2);
  out.across = found.side.frame.leftCols<2>();
  out.radius = found.side.radius;
  out.covariance = *covariance;
  write_extent(points, found, out);
  out.fit.final_rms = out.noise / std::max(sigma, 1e-12);
  const double std_radius = std::sqrt(out.covariance(4, 4));
  if (options.radius == 0 && std_radius > options.accepted_std * out.radius)
    return refused(out, "the arc is too short for the radius: its standard deviation is " +
                            std::to_string(static_cast<int>(std::lround(100 * std_radius / out.radius))) +
                            " % of it; give the radius, or scan more of the side");
  if (out.outliers > out.points) return refused(out, "more points contradict the cylinder than agree with it");
  out.fit.status = FitStatus::Converged;
  out.fit.message = "converged";
  return out;
}

}  // namespace kr5::picking
