// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <kr5/core/linear.hpp>
#include <kr5/force/depth_profile.hpp>

#include "force/azimuth.hpp"

namespace kr5::force {
namespace {

/// Centre x, y and height of the face.
using Place = Eigen::Vector3d;

/// A profile to be explained, and how well a place does it.
class Profile {
 public:
  Profile(const PegTube& bodies, double tilt, std::span<const double> azimuth, std::span<const double> height)
      : bodies_(bodies), tilt_(tilt), azimuth_(azimuth), height_(height) {}

  struct Normal {
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    double cost = 0.0;  ///< Sum of squares [m^2]; infinite where the peg would fall.
  };

  Normal at(const Place& place) const {
    Normal out;
    for (std::size_t k = 0; k < azimuth_.size(); ++k) {
      const PegRest rest = rest_peg_on_tube(bodies_, tilt_, azimuth_[k], place.head<2>());
      const double error = height_[k] - place.z() - rest.height;
      if (std::isnan(error)) return {out.A, out.b, std::numeric_limits<double>::infinity()};
      const Eigen::Vector3d slope(rest.by_centre.x(), rest.by_centre.y(), 1.0);
      out.A += slope * slope.transpose();
      out.b += slope * error;
      out.cost += error * error;
    }
    return out;
  }

  /// The face that suits a centre best.
  Place with_face(const Eigen::Vector2d& centre) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < azimuth_.size(); ++k)
      sum += height_[k] - rest_peg_on_tube(bodies_, tilt_, azimuth_[k], centre).height;
    return {centre.x(), centre.y(), sum / static_cast<double>(azimuth_.size())};
  }

 private:
  const PegTube& bodies_;
  double tilt_;
  std::span<const double> azimuth_, height_;
};

struct Solution {
  Place place = Place::Zero();
  Profile::Normal normal;
  int iterations = 0;
  bool converged = false;
};

/// Levenberg-Marquardt from one start.
Solution minimise(const Profile& profile, const Place& start, int max_iterations) {
  Solution out{start, profile.at(start)};
  double damping = 1e-3;
  for (; out.iterations < max_iterations && !out.converged && std::isfinite(out.normal.cost); ++out.iterations) {
    Eigen::Matrix3d A = out.normal.A;
    A.diagonal() *= 1 + damping;
    A.diagonal().array() += 1e-12;
    const SymmetricEigen of = symmetric_eigen(A);
    const Eigen::Vector3d step =
        of.vectors * (of.vectors.transpose() * out.normal.b).cwiseQuotient(of.values.cwiseMax(1e-12));
    out.converged = step.norm() < 1e-10;  // a tenth of a nanometre
    const Profile::Normal moved = profile.at(out.place + step);
    if (moved.cost <= out.normal.cost) {
      out.place += step;
      out.normal = moved;
      damping = std::max(damping / 5, 1e-9);
    } else {
      damping *= 8;
      out.converged = out.converged || damping > 1e8;
    }
  }
  return out;
}

/// From all round, near and far: the profile of a place and that of its mirror image differ by little only.
Solution best_of(const Profile& profile, const PegTube& bodies, int max_iterations) {
  constexpr int directions = 12;
  Solution best;
  best.normal.cost = std::numeric_limits<double>::infinity();
  for (const double part : {0.2, 0.5, 0.85, 1.2})
    for (int k = 0; k < directions; ++k) {
      const double azimuth = 2 * M_PI * k / directions, distance = part * bodies.outer_radius;
      const Place start = profile.with_face(distance * Eigen::Vector2d(std::cos(azimuth), std::sin(azimuth)));
      if (!start.allFinite()) continue;
      Solution found = minimise(profile, start, max_iterations);
      found.iterations += best.iterations;
      if (found.normal.cost < best.normal.cost)
        best = found;
      else
        best.iterations = found.iterations;
    }
  return best;
}

/// Part of the turn that rows cover: what the widest gap between them leaves.
double covered(std::span<const double> azimuth) {
  std::vector<double> sorted(azimuth.begin(), azimuth.end());
  for (double& a : sorted) a = std::remainder(a, 2 * M_PI);
  std::sort(sorted.begin(), sorted.end());
  double gap = sorted.front() + 2 * M_PI - sorted.back();
  for (std::size_t k = 1; k < sorted.size(); ++k) gap = std::max(gap, sorted[k] - sorted[k - 1]);
  return 2 * M_PI - gap;
}

TubeFit unknown(const std::string& why) {
  TubeFit out;
  out.report.message = why;
  return out;
}

void check_rows(std::span<const double> azimuth, std::span<const double> height) {
  require(azimuth.size() == height.size(), "fit_tube: found " + std::to_string(azimuth.size()) + " azimuths and " +
                                               std::to_string(height.size()) + " heights, expected as many");
  for (std::size_t k = 0; k < azimuth.size(); ++k)
    require(std::isfinite(azimuth[k]) && std::isfinite(height[k]),
            "fit_tube: row " + std::to_string(k + 1) + " holds a number that is not finite");
}

}  // namespace

void TubeFitOptions::validate() const {
  require(noise >= 0 && std::isfinite(noise), "noise must not be negative [m]");
  require(max_iterations >= 1, "max_iterations must be at least 1");
}

TubeFit fit_tube(const PegTube& bodies, double tilt, std::span<const double> azimuth, std::span<const double> height,
                 const TubeFitOptions& options) {
  options.validate();
  require_tilt(bodies, tilt);
  check_rows(azimuth, height);
  constexpr std::size_t least_rows = 6;
  if (azimuth.size() < least_rows)
    return unknown("found " + std::to_string(azimuth.size()) + " rows, expected at least 6");
  if (covered(azimuth) < M_PI_2) return unknown("the rows cover less than a quarter of the turn");

  const Profile profile(bodies, tilt, azimuth, height);
  const Solution best = best_of(profile, bodies, options.max_iterations);
  const auto n = static_cast<double>(azimuth.size());
  TubeFit out;
  out.centre = best.place.head<2>();
  out.face = best.place.z();
  out.rms = std::sqrt(best.normal.cost / n);
  const SymmetricEigen of = symmetric_eigen(best.normal.A);
  if (!std::isfinite(best.normal.cost) || of.values(0) < 1e-9 * n) {
    out.report.message = "the profile is flat: the peg stayed on the face all round, or fell into the bore";
    return out;
  }
  const double sigma = options.noise > 0 ? options.noise : std::sqrt(best.normal.cost / (n - 3));
  out.covariance = sigma * sigma * of.vectors * of.values.cwiseInverse().asDiagonal() * of.vectors.transpose();
  out.report.status = best.converged ? FitStatus::Converged : FitStatus::MaxIterations;
  out.report.iterations = best.iterations;
  out.report.final_rms = sigma > 0 ? out.rms / sigma : 0.0;
  out.report.message = best.converged ? "converged" : "stopped after max_iterations";
  const double distance = out.centre.norm();
  out.azimuth = wrapped(std::atan2(-out.centre.y(), -out.centre.x()));
  const Eigen::Vector2d across = Eigen::Vector2d(-out.centre.y(), out.centre.x()) / std::max(distance, 1e-12);
  const double off = std::sqrt(across.dot(out.covariance.topLeftCorner<2, 2>() * across));
  out.azimuth_std = distance > off ? off / distance : M_PI;
  return out;
}

}  // namespace kr5::force
