// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/force/depth_profile.hpp>

#include <cmath>

#include "force/search/azimuth.hpp"

namespace kr5::force {
namespace {

/// The minimum on the line of symmetry at this azimuth, if there is one.
void add_minimum(const PegTube& bodies, double tilt, const Eigen::Vector2d& centre, double azimuth,
                 std::vector<DepthMinimum>& out) {
  constexpr double beside = 1e-7;
  const PegRest here = rest_peg_on_tube(bodies, tilt, azimuth, centre);
  if (here.kind == RestContact::None || here.kind == RestContact::RimOnFace) return;
  const double left = rest_peg_on_tube(bodies, tilt, azimuth - beside, centre).by_alpha;
  const double right = rest_peg_on_tube(bodies, tilt, azimuth + beside, centre).by_alpha;
  if (!(right > left)) return;
  const bool cusp = here.kind == RestContact::RimOnInnerEdge;
  out.push_back({wrapped(azimuth), here.height, cusp ? right - left : 0.0, cusp, here.kind});
}

}  // namespace

std::vector<DepthMinimum> depth_minima(const PegTube& bodies, double tilt, const Eigen::Vector2d& centre) {
  require_tilt(bodies, tilt);
  require(centre.allFinite(), "centre must be finite [m]");
  std::vector<DepthMinimum> out;
  if (centre.norm() == 0) return out;
  const double away = std::atan2(centre.y(), centre.x());
  add_minimum(bodies, tilt, centre, away + M_PI, out);
  add_minimum(bodies, tilt, centre, away, out);
  return out;
}

double critical_offset(const PegTube& bodies, double tilt) {
  require_tilt(bodies, tilt);
  const double t2 = std::pow(std::tan(tilt), 2), r = bodies.peg_radius, R1 = bodies.inner_radius,
               R2 = bodies.outer_radius;
  const double a = 3 - t2, half = R2 * (1 - t2), c = r * r - R1 * R1 - R2 * R2 * t2;
  const double root = half * half - a * c;
  if (root < 0 || a <= 0) return R2;
  const double out = (half + std::sqrt(root)) / a;
  return out > 0 ? std::min(out, R2) : R2;
}

double azimuth_error(const PegTube& bodies, double tilt, const Eigen::Vector2d& centre, double depth_error) {
  require(depth_error >= 0, "depth_error must not be negative [m]");
  const std::vector<DepthMinimum> minima = depth_minima(bodies, tilt, centre);
  require(!minima.empty() && minima.front().cusp, "no cusp: the peg does not enter the bore");
  const DepthMinimum& at = minima.front();
  const auto risen = [&](double by) {
    return rest_peg_on_tube(bodies, tilt, at.azimuth + by, centre).height - at.height >= depth_error;
  };
  if (!risen(M_PI_2)) return M_PI;
  double low = 0.0, high = M_PI_2;
  for (int i = 0; i < 60; ++i) (risen((low + high) / 2) ? high : low) = (low + high) / 2;
  return high;
}

Eigen::MatrixXd depth_map(const PegTube& bodies, double tilt, double azimuth, std::span<const double> x,
                          std::span<const double> y) {
  require_tilt(bodies, tilt);
  Eigen::MatrixXd out(static_cast<Eigen::Index>(y.size()), static_cast<Eigen::Index>(x.size()));
  for (Eigen::Index i = 0; i < out.rows(); ++i)
    for (Eigen::Index j = 0; j < out.cols(); ++j)
      out(i, j) =
          rest_peg_on_tube(bodies, tilt, azimuth, {x[static_cast<std::size_t>(j)], y[static_cast<std::size_t>(i)]})
              .height;
  return out;
}

}  // namespace kr5::force
