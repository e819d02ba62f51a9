// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/force/fit_tube.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <kr5/core/linear.hpp>

#include "force/search/azimuth.hpp"
#include "force/search/tube_search.hpp"

namespace kr5::force {
namespace {

/// Part of the turn that rows cover: what the widest gap between them leaves.
double covered(std::span<const double> azimuth) {
  std::vector<double> sorted(azimuth.begin(), azimuth.end());
  for (double& a : sorted) a = std::remainder(a, 2 * M_PI);
  std::sort(sorted.begin(), sorted.end());
  double gap = sorted.front() + 2 * M_PI - sorted.back();
  for (std::size_t k = 1; k < sorted.size(); ++k) gap = std::max(gap, sorted[k] - sorted[k - 1]);
  return 2 * M_PI - gap;
}

/// A constant height explains the rows about as well as a tube does.
bool flat(std::span<const double> height, double cost, double noise) {
  const auto n = static_cast<double>(height.size());
  double sum = 0.0, squares = 0.0;
  for (const double h : height) sum += h;
  for (const double h : height) squares += (h - sum / n) * (h - sum / n);
  constexpr double by_chance = 12.0;  // F and chi square of two more parameters, one in a hundred thousand
  const double variance = noise > 0 ? noise * noise : cost / (n - 3);
  return squares - cost <= 2 * by_chance * variance;
}

TubeFit unknown(const std::string& why) {
  TubeFit out;
  out.report.message = why;
  return out;
}

void check_rows(std::span<const double> azimuth, std::span<const double> height) {
  require(azimuth.size() == height.size(), "fit_tube: found " + std::to_string(azimuth.size()) + " azimuths and " +
                                               std::to_string(height.size()) + " heights, expected equal numbers");
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
  constexpr std::size_t min_rows = 6;
  if (azimuth.size() < min_rows)
    return unknown("found " + std::to_string(azimuth.size()) + " rows, expected at least 6");
  if (covered(azimuth) < M_PI_2) return unknown("the rows cover less than a quarter of the turn");

  std::vector<ProfileRow> rows(azimuth.size());
  for (std::size_t k = 0; k < rows.size(); ++k) {
    rows[k].azimuth = azimuth[k];
    rows[k].tilt = tilt;
    rows[k].height = height[k];
  }
  TubeSearch search(bodies, options.max_iterations);
  search.begin(rows, Eigen::Vector2d::Zero());
  while (!search.advance(1000)) {
  }
  const TubeSearch::Solution& best = search.best();
  const auto n = static_cast<double>(azimuth.size());
  TubeFit out;
  out.centre = -best.place.head<2>();
  out.face = best.place.z();
  out.rms = std::sqrt(best.normal.cost / n);
  const SymmetricEigen of = symmetric_eigen(best.normal.information.topLeftCorner<3, 3>());
  if (!std::isfinite(best.normal.cost) || of.values(0) < 1e-9 * n || flat(height, best.normal.cost, options.noise)) {
    out.report.message = "the profile is flat: the peg stayed on the face for the whole turn, or dropped into the bore";
    return out;
  }
  const double sigma = options.noise > 0 ? options.noise : std::sqrt(best.normal.cost / (n - 3));
  const Eigen::Vector3d turned(-1.0, -1.0, 1.0);  // from where the tube is to where the peg is
  const Eigen::Matrix3d W = turned.asDiagonal() * of.vectors;
  out.covariance = sigma * sigma * W * of.values.cwiseInverse().asDiagonal() * W.transpose();
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
