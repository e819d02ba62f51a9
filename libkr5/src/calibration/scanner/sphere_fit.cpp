// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/sphere_fit.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/core/levenberg_marquardt.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/uncertainty/confidence.hpp>

namespace kr5::calibration {
namespace {

constexpr double min_extent = 1e-3;  // of points across a line, over their extent along it

struct CentreProblem {
  const Eigen::Matrix3Xd& points;
  double radius;

  NormalEquations<3> equations(const Eigen::Vector3d& centre) const {
    NormalEquations<3> out;
    for (const auto point : points.colwise()) {
      const Eigen::Vector3d away = point - centre;
      const double distance = away.norm();
      if (distance > 0) out.add(-away / distance, distance - radius);
    }
    return out;
  }
};

/// Whether points lie on one line.
bool on_a_line(const Eigen::Matrix3Xd& points) {
  const Eigen::VectorXd extent = singular_values(points.colwise() - points.rowwise().mean().eval());
  return !(extent[1] > min_extent * extent[0]);
}

}  // namespace

SphereFit fit_sphere(const Eigen::Matrix3Xd& points, double radius, const Eigen::Vector3d& start) {
  require(radius > 0 && std::isfinite(radius), "radius must be positive [m]");
  require(points.allFinite() && start.allFinite(), "points and start must be finite");
  SphereFit out;
  out.centre = start;
  if (points.cols() < 4 || on_a_line(points)) {
    out.fit.message = points.cols() < 4
                          ? "found " + std::to_string(points.cols()) + " points of the sphere, expected at least four"
                          : "the points lie on one line";
    return out;
  }
  const CentreProblem problem{points, radius};
  const double sigma_start = std::sqrt(problem.equations(start).variance());
  const auto found = levenberg_marquardt<3>(start, problem);
  const NormalEquations<3> end = problem.equations(found.x);
  const auto covariance = end.covariance();
  if (!found.usable() || !covariance) {
    out.fit.message = "the points do not determine the centre of a sphere of this radius";
    return out;
  }
  const double sigma = std::max(std::sqrt(end.variance()), 1e-12);
  out.centre = found.x;
  out.covariance = *covariance * uncertainty::covariance_inflation(3, static_cast<double>(points.cols() - 3));
  out.rms = std::sqrt(end.cost / static_cast<double>(points.cols()));
  out.fit = {FitStatus::Converged, found.iterations, sigma_start / sigma, out.rms / sigma, "converged"};
  return out;
}

}  // namespace kr5::calibration
