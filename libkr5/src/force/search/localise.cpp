// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/force/localise.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/force/fit_tube.hpp>

#include "force/search/azimuth.hpp"

namespace kr5::force {
namespace {

constexpr double felt_force = 0.5;  // below it nothing is touched [N]

std::vector<TurnRow> touching(const std::vector<TurnRow>& rows, const char* who) {
  std::vector<TurnRow> out;
  for (const TurnRow& row : rows) {
    require(
        std::isfinite(row.azimuth) && std::isfinite(row.force) && row.moment.allFinite(),
        std::string(who) + ": row " + std::to_string(&row - rows.data() + 1) + " holds a number that is not finite");
    if (row.force > felt_force) out.push_back(row);
  }
  return out;
}

/// How far to the left of the tilt's direction the force acts [m].
double aside(const TurnRow& row) {
  const Eigen::Vector2d point(-row.moment.y() / row.force, row.moment.x() / row.force);
  return Eigen::Vector2d(-std::sin(row.azimuth), std::cos(row.azimuth)).dot(point);
}

/// Standard deviation of aside(), from what changes between neighbours in the middle [m].
double noise_aside(const std::vector<TurnRow>& rows) {
  std::vector<double> change;
  for (std::size_t k = 1; k < rows.size(); ++k) change.push_back(std::abs(aside(rows[k]) - aside(rows[k - 1])));
  std::nth_element(change.begin(), change.begin() + static_cast<long>(change.size() / 2), change.end());
  return change[change.size() / 2] / (0.6745 * std::sqrt(2.0));
}

}  // namespace

TurnDirection locate_by_force(const PegTube& bodies, double tilt, double stiffness, const std::vector<TurnRow>& rows) {
  require(stiffness > 0 && std::isfinite(stiffness), "stiffness must be positive [N/m]");
  std::vector<double> azimuth, height;
  for (const TurnRow& row : touching(rows, "locate_by_force")) {
    azimuth.push_back(row.azimuth);
    height.push_back(row.force / stiffness);
  }
  const TubeFit fit = fit_tube(bodies, tilt, azimuth, height);
  return {fit.report, fit.azimuth, fit.azimuth_std};
}

TurnDirection locate_by_moment(const std::vector<TurnRow>& given) {
  std::vector<TurnRow> rows = touching(given, "locate_by_moment");
  TurnDirection out;
  constexpr std::size_t least = 12;
  if (rows.size() < least) {
    out.report.message = "found " + std::to_string(rows.size()) + " rows under a force, expected at least 12";
    return out;
  }
  for (TurnRow& row : rows) row.azimuth = wrapped(row.azimuth);
  std::sort(rows.begin(), rows.end(), [](const TurnRow& a, const TurnRow& b) { return a.azimuth < b.azimuth; });
  // Before the cusp the peg rests on the right of its tilt, behind it on the left: the greatest change of the sums on
  // either side of a row, over a tenth of the turn.
  const auto n = rows.size(), wide = std::max<std::size_t>(n / 10, 3);
  std::size_t at = 0;
  double sharpest = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    double jump = 0.0;
    for (std::size_t i = 1; i <= wide; ++i) jump += aside(rows[(k + i) % n]) - aside(rows[(k + n + 1 - i) % n]);
    if (jump > sharpest) sharpest = jump, at = k;
  }
  constexpr double rounding = 1e-9;  // [m]
  const double by_chance = 8 * noise_aside(rows) * std::sqrt(2.0 * static_cast<double>(wide));
  if (sharpest <= by_chance + rounding) {
    out.report.message = "the side of the contact nowhere changes as it does over a hole";
    return out;
  }
  const TurnRow &left = rows[at], &right = rows[(at + 1) % n];
  const double step = std::remainder(right.azimuth - left.azimuth, 2 * M_PI);
  out.azimuth = wrapped(left.azimuth + 0.5 * step);
  out.azimuth_std = std::abs(step) / std::sqrt(12.0);
  out.report.status = FitStatus::Converged;
  out.report.message = "converged";
  return out;
}

}  // namespace kr5::force
