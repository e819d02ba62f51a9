// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/picking/pellets.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/picking/cylinder_fit.hpp>

#include "pellet_fit.hpp"
#include "pellet_hypotheses.hpp"
#include "view_estimate.hpp"

namespace kr5::picking {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

void PelletOptions::validate() const {
  require(radius > 0 && radius < 1, "radius must be positive and below 1 [m]");
  require(radius_tolerance >= 0 && radius_tolerance < 0.5 * radius,
          "radius_tolerance must lie below half the radius [m]");
  require(min_height > 0 && std::isfinite(min_height), "min_height must be positive [m]");
  require(max_height >= min_height && std::isfinite(max_height), "max_height must be min_height or more [m]");
  require(noise >= 0 && noise < radius, "noise must lie below the radius [m]");
  require(min_exposed >= 0 && min_exposed < 1, "min_exposed must lie between 0 and 1 [-]");
  require(max_crossed >= 0 && max_crossed < 1, "max_crossed must lie between 0 and 1 [-]");
  require(accepted_position_std > 0, "accepted_position_std must be positive [m]");
  require(accepted_axis_std > 0, "accepted_axis_std must be positive [rad]");
}

namespace {

/// Whether solids of cylinders share more than a thin layer.
bool overlap(const SolidCylinder& a, const SolidCylinder& b, double allowed) {
  const double least = std::min(a.radius, a.height / 2) + std::min(b.radius, b.height / 2);
  const double apart = (a.centre - b.centre).norm();
  if (apart < 0.85 * least) return true;
  if (apart > a.bounding_radius() + b.bounding_radius()) return false;
  return std::min(b.distance_to_side_of(a), a.distance_to_side_of(b)) < -allowed;
}

/// How far a cylinder reaches out of the bin, through the floor or a wall.
double reach_out(const SolidCylinder& c, const Bin& bin) {
  const Matrix3d R = bin.T_base_bin.linear().transpose();
  const Vector3d centre = bin.T_base_bin.inverse() * c.centre, axis = R * c.axis();
  Vector3d half;  // extent of the cylinder along each direction of the bin
  for (int k = 0; k < 3; ++k)
    half[k] = std::abs(axis[k]) * c.height / 2 + std::sqrt(std::max(0.0, 1 - axis[k] * axis[k])) * c.radius;
  return std::max({half.z() - centre.z(), std::abs(centre.x()) + half.x() - bin.size.x() / 2,
                   std::abs(centre.y()) + half.y() - bin.size.y() / 2});
}

/// Tangents of the angles by which rays may run otherwise than is thought: those whose origin was told, and those whose
/// origin was estimated.
constexpr double told_slack = 0.03, estimated_slack = 0.06;

class PelletSearch {
 public:
  PelletSearch(const Cloud& cloud, const Bin& bin, const PelletOptions& options, const RayGrid& rays, double slack)
      : cloud_(cloud),
        bin_(bin),
        options_(options),
        all_(rays),
        thinned_(rays.thinned(options.radius / 8)),
        scene_{options, thinned_, std::vector<bool>(static_cast<std::size_t>(cloud.points.cols()), false),
               options.noise > 0 ? options.noise : options.radius / 100, slack} {}

  PelletResult run(const std::vector<Patch>& patches) {
    result_.patches = static_cast<int>(patches.size());
    std::vector<Patch> open = patches;
    for (int round = 0; round < 3 && !open.empty(); ++round) {
      std::vector<PelletFit> fits;
      for (const Patch& patch : open)
        for (const SolidCylinder& start : hypotheses(scene_, cloud_, patch)) {
          ++result_.hypotheses;
          fits.push_back(fit_pellet(scene_, start, FitStart::Hypothesis));
        }
      if (round == 0 && options_.noise == 0) {
        learn_noise(fits);
        for (PelletFit& fit : fits) fit.verdict = judge(scene_, fit.cylinder);
      }
      const std::size_t before = accepted_.size();
      accept_best(std::move(fits));
      if (accepted_.size() == before) break;
      open = left_of(patches);
    }
    return finish(patches);
  }

 private:
  bool acceptable(const PelletFit& fit) const {
    const RayVerdict& v = fit.verdict;
    return v.exposed() >= options_.min_exposed && v.crossed() <= options_.max_crossed && v.new_on >= 12 &&
           v.new_on > 0.6 * v.on && v.close < 0.5 * v.on &&
           (fit.side > fit.face || (v.beyond_rim() < 0.35 && v.broken_rim() < 0.1)) &&
           fit.rms < 2.5 * std::max(scene_.noise, 0.01 * options_.radius) &&
           reach_out(fit.cylinder, bin_) < 0.25 * options_.radius;
  }

  /// Best first; what was accepted explains its points.
  void accept_best(std::vector<PelletFit> fits) {
    std::sort(fits.begin(), fits.end(),
              [](const PelletFit& a, const PelletFit& b) { return a.verdict.score() > b.verdict.score(); });
    for (PelletFit& fit : fits) {
      if (!acceptable(fit)) continue;
      const auto collides = [&](const PelletFit& other) {
        return overlap(fit.cylinder, other.cylinder, 0.2 * options_.radius);
      };
      if (std::any_of(accepted_.begin(), accepted_.end(), collides)) continue;
      fit.verdict = judge(scene_, fit.cylinder);
      if (!acceptable(fit)) continue;
      explain(fit.cylinder);
      accepted_.push_back(fit);
    }
  }

  void explain(const SolidCylinder& c) {
    all_.near(c.centre, c.bounding_radius(), [&](const RayGrid::Ray& ray) {
      if (std::abs(c.distance(c.local(ray.point))) < 1.5 * scene_.tolerance())
        scene_.explained[static_cast<std::size_t>(ray.column)] = true;
    });
  }

  /// From the better half of the fits that explain much.
  void learn_noise(const std::vector<PelletFit>& fits) {
    std::vector<double> rms;
    for (const PelletFit& fit : fits)
      if (fit.verdict.on >= 40 && fit.verdict.crossed() <= options_.max_crossed) rms.push_back(fit.rms);
    if (rms.size() < 3) return;
    const auto middle = rms.begin() + static_cast<std::ptrdiff_t>(rms.size() / 2);
    std::nth_element(rms.begin(), middle, rms.end());
    scene_.noise = std::clamp(median({rms.begin(), middle + 1}), options_.radius / 1000, options_.radius / 20);
  }

  /// What no cylinder explains yet, in connected parts, for it may be of several surfaces.
  std::vector<Patch> left_of(const std::vector<Patch>& patches) const {
    std::vector<bool> taken(scene_.explained.size(), false);  // a point may stand in several patches
    std::vector<Patch> out;
    for (const Patch& patch : patches) {
      std::vector<int> left;
      for (const int column : patch.points)
        if (!scene_.explained[static_cast<std::size_t>(column)] && !taken[static_cast<std::size_t>(column)]) {
          left.push_back(column);
          taken[static_cast<std::size_t>(column)] = true;
        }
      const bool whole = static_cast<double>(left.size()) > 0.8 * static_cast<double>(patch.points.size());
      for (std::vector<int>& part : connected(std::move(left), 0.4 * options_.radius)) {
        if (part.size() < 10) continue;
        Patch rest = patch;
        if (!whole) rest.kind = PatchKind::Mixed;
        rest.points = std::move(part);
        out.push_back(std::move(rest));
      }
    }
    return out;
  }

  /// Points that touch, by way of others, within `reach`; sorted into cubes of that side, so that only neighbours are
  /// looked at.
  std::vector<std::vector<int>> connected(const std::vector<int>& columns, double reach) const {
    using Cube = std::array<int, 3>;
    const auto cube_of = [&](int column) {
      const Eigen::Array3i at = (cloud_.points.col(column).array() / reach).floor().cast<int>();
      return Cube{at[0], at[1], at[2]};
    };
    std::map<Cube, std::vector<int>> cubes;
    for (const int column : columns) cubes[cube_of(column)].push_back(column);
    std::vector<std::vector<int>> out;
    while (!cubes.empty()) {
      std::vector<int> part{cubes.begin()->second.back()};
      cubes.begin()->second.pop_back();
      for (std::size_t k = 0; k < part.size(); ++k) take_near(part[k], cube_of(part[k]), reach, cubes, part);
      std::erase_if(cubes, [](const auto& entry) { return entry.second.empty(); });
      out.push_back(std::move(part));
    }
    return out;
  }

  /// Moves the points near one from the cubes into its part.
  void take_near(int column, const std::array<int, 3>& cube, double reach,
                 std::map<std::array<int, 3>, std::vector<int>>& cubes, std::vector<int>& part) const {
    const Vector3d at = cloud_.points.col(column);
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z) {
          const auto found = cubes.find({cube[0] + x, cube[1] + y, cube[2] + z});
          if (found == cubes.end()) continue;
          std::erase_if(found->second, [&](int other) {
            const bool near = (cloud_.points.col(other) - at).squaredNorm() < reach * reach;
            if (near) part.push_back(other);
            return near;
          });
        }
  }

  /// Each fitted again with the noise as learnt, and judged with all others in place.
  PelletResult finish(const std::vector<Patch>& patches) {
    for (const PelletFit& fit : accepted_) {
      const PelletScene alone{options_, all_, without(fit.cylinder), scene_.noise, scene_.slack};
      const PelletFit final = fit_pellet(alone, fit.cylinder, FitStart::Fitted);
      const Eigen::Matrix3d centre = final.covariance.topLeftCorner<3, 3>();
      const Eigen::Matrix2d tilt = final.covariance.block<2, 2>(3, 3);
      const double position_std = std::sqrt(symmetric_eigen(centre).values[2]);
      const double axis_std = std::sqrt(symmetric_eigen(tilt).values[1]);
      if (position_std > options_.accepted_position_std || axis_std > options_.accepted_axis_std ||
          final.verdict.crossed() > options_.max_crossed || final.verdict.exposed() < options_.min_exposed) {
        ++result_.doubtful;
        continue;
      }
      result_.pellets.push_back(listed(final));
    }
    std::stable_sort(result_.pellets.begin(), result_.pellets.end(),
                     [](const Pellet& a, const Pellet& b) { return a.exposed > b.exposed; });
    result_.noise = scene_.noise;
    for (const Patch& patch : left_of(patches)) result_.unexplained += static_cast<int>(patch.points.size());
    return std::move(result_);
  }

  /// The points explained by all others.
  std::vector<bool> without(const SolidCylinder& c) const {
    std::vector<bool> out = scene_.explained;
    std::vector<const SolidCylinder*> others;
    for (const PelletFit& o : accepted_)
      if (&o.cylinder != &c && (o.cylinder.centre - c.centre).norm() < 4 * c.bounding_radius())
        others.push_back(&o.cylinder);
    all_.near(c.centre, c.bounding_radius(), [&](const RayGrid::Ray& ray) {
      const double own = std::abs(c.distance(c.local(ray.point)));
      if (own > 1.5 * scene_.tolerance()) return;
      out[static_cast<std::size_t>(ray.column)] = std::any_of(
          others.begin(), others.end(),
          [&](const SolidCylinder* other) { return std::abs(other->distance(other->local(ray.point))) < own; });
    });
    return out;
  }

  Pellet listed(const PelletFit& fit) const {
    Pellet out;
    out.centre = fit.cylinder.centre;
    out.frame = fit.cylinder.frame;
    out.axis = fit.cylinder.axis();
    out.radius = fit.cylinder.radius;
    out.height = fit.cylinder.height;
    out.covariance = fit.covariance;
    if (out.axis.dot(bin_.T_base_bin.linear().col(2)) < 0) {  // turned about the first axis of the frame
      out.frame.col(1) *= -1;
      out.frame.col(2) *= -1;
      out.axis = out.frame.col(2);
      const Eigen::Matrix<double, 7, 1> signs{1, -1, -1, 1, -1, 1, 1};
      out.covariance = signs.asDiagonal() * out.covariance * signs.asDiagonal();
    }
    out.exposed = fit.verdict.exposed();
    out.crossed = fit.verdict.crossed();
    out.side_seen = fit.side > 0;
    out.face_seen = fit.face > 0;
    out.rms = fit.rms;
    out.points = fit.side + fit.face;
    return out;
  }

  const Cloud& cloud_;
  const Bin& bin_;
  const PelletOptions& options_;
  const RayGrid& all_;
  RayGrid thinned_;
  PelletScene scene_;
  PelletResult result_;
  std::vector<PelletFit> accepted_;
};

}  // namespace

PelletResult find_pellets(const Cloud& cloud, const Bin& bin, const PelletOptions& options) {
  options.validate();
  PelletResult out;
  out.check = check_cloud(cloud, bin, options.radius);
  if (out.check.finding != CloudFinding::Good) return out;
  const Vector3d up = bin.T_base_bin.linear().col(2);
  const double margin = std::max(3 * options.noise, 0.1 * options.radius);
  Bin heaped = bin;  // a pile may stand above the rim
  heaped.size.z() += 4 * std::hypot(options.radius, options.max_height / 2);
  Cloud within = crop(cloud, heaped, -options.radius, -0.5 * options.radius);
  const bool told = cloud.origins.cols() > 0;
  if (!told)
    within.origins =
        estimated_origins(within, bin, std::max(options.radius / 8, out.check.spacing), options.radius / 4);
  const RayGrid rays(within, up, options.radius / 8);
  Cloud above = within;  // the same columns, floor and walls left out
  const Pose T_bin_base = bin.T_base_bin.inverse();
  for (Index i = 0; i < above.points.cols(); ++i) {
    const Vector3d p = T_bin_base * above.points.col(i);
    const bool inside = p.z() > margin && std::abs(p.x()) < bin.size.x() / 2 - margin / 2 &&
                        std::abs(p.y()) < bin.size.y() / 2 - margin / 2;
    if (!inside) above.points.col(i).setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  const std::vector<Patch> patches = find_patches(above, up, PatchOptions::for_radius(options.radius, rays.pitch()));
  PelletResult result = PelletSearch(within, bin, options, rays, told ? told_slack : estimated_slack).run(patches);
  result.check = out.check;
  return result;
}

}  // namespace kr5::picking
